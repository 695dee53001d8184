"""Baselines: the scores that simple methods achieve without learning."""
