"""Ensembles of perturbed releases of a scene, and sweeps over grids of its parameters."""
