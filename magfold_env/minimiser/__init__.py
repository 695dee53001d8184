"""Energies of folds on the lattice, and the minimisers that predict a fold from them."""

from magfold_env.minimiser.descent import Descent, descend
from magfold_env.minimiser.ground_state import GroundStates, ground_state
from magfold_env.minimiser.result import Decision, Minimum, Option, State
from magfold_env.minimiser.search import minimise
from magfold_env.minimiser.sequence_space import EverySequence, sequence_of
from magfold_env.minimiser.word_landscape import Landscape

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
