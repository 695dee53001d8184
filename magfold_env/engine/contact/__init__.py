"""Contact: squares against squares and the tube, joint stops, impacts."""
