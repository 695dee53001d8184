"""Pictures, windows and recordings of environments."""
