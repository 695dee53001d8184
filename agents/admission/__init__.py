"""Whether a task needs its physics: the rule of admission, ``python -m agents.admission ID``."""
