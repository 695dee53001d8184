"""The admission rule (``python -m agents.admission``), a test whether a task needs its physics."""
