"""The admission rule (``python -m agents.admission``): a test of whether a task needs physics."""
