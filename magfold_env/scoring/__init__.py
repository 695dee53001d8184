"""Scores of submitted policies and actions, on draws that are announced after submission."""
