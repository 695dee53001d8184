"""Feed control: a given chain whose feed speed is chosen from moment to moment."""
