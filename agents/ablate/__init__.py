"""What of a trained policy earns its score: the policy beside what is left when a part is taken."""

FORMAT = "magfold_env ablation 1"
"""Of ``ablation.json``."""
