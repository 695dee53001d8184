"""Training and evaluation of policies with Stable-Baselines3."""
