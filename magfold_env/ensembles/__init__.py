"""Many perturbed releases of a scene, and of all that a grid of its numbers makes of it."""
