"""What environments show."""
