"""Searches that choose before the chain folds."""
