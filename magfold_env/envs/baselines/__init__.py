"""Baselines: the scores that energy minimisation achieves without learning."""
