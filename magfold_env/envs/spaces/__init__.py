"""Action and observation spaces."""
