"""Searches that make all choices before the chain folds."""
