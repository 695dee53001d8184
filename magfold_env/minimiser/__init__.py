"""Energies of folds on the lattice, and the minimisers that predict a fold from them."""

from magfold_env.minimiser.descent import Descent, descend
from magfold_env.minimiser.every_sequence import EverySequence, sequence_of
from magfold_env.minimiser.ground_states import GroundStates, ground_state
from magfold_env.minimiser.landscape import Landscape
from magfold_env.minimiser.search import Decision, Minimum, Mode, Option, minimise
from magfold_env.minimiser.states import Among, State

__all__ = [
    "Among",
    "Decision",
    "Descent",
    "EverySequence",
    "GroundStates",
    "Landscape",
    "Minimum",
    "Mode",
    "Option",
    "State",
    "descend",
    "ground_state",
    "minimise",
    "sequence_of",
]
