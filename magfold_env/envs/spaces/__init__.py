"""Actions and observations: how they are written and read."""
