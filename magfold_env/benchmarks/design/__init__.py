"""How well, and at what cost, sequences are designed for wanted shapes."""
