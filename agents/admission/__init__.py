"""Whether a task needs its physics: the rule of admission, ``python -m agents.admission ID``."""

FORMAT = "magfold_env admission 2"
"""Of ``admission.json``."""
