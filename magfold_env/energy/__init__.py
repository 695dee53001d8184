"""Energies of folds on the lattice, and the minimisers that predict a fold from them."""

from magfold_env.energy.descent import Descent, descend
from magfold_env.energy.ground_state import GroundStates, ground_state
from magfold_env.energy.result import Decision, Minimum, Option, State
from magfold_env.energy.search import minimise
from magfold_env.energy.sequence_space import EverySequence, sequence_of
from magfold_env.energy.word_landscape import Landscape

__all__ = [
    "Decision",
    "Descent",
    "EverySequence",
    "GroundStates",
    "Landscape",
    "Minimum",
    "Option",
    "State",
    "descend",
    "ground_state",
    "minimise",
    "sequence_of",
]
