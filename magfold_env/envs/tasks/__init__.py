"""Tasks: targets, rewards and draws of the physics."""
