"""What is wanted and rewarded, and how physics is drawn."""
