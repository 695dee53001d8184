"""Searches for settings: Optuna's studies, in one process or on a cluster."""
