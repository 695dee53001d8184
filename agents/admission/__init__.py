"""The admission rule (``python -m agents.admission``): whether a task needs its physics."""
