"""Energies of folds on the lattice, and the minimiser that predicts a fold from them."""

from magfold_env.energy.result import Decision, Minimum, Option, State
from magfold_env.energy.search import minimise

__all__ = ["Decision", "Minimum", "Option", "State", "minimise"]
