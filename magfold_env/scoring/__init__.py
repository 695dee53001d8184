"""Scores of policies and of actions that others hand in, on draws that are announced afterwards."""
