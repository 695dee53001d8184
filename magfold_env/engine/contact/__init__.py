"""Contact of squares with squares, obstacles and the tube, joint stops, and impacts."""
