"""Energies of folds on the lattice, and the minimisers that predict a fold from them."""

from magfold_env.minimiser.energies import refuse_field, strengths
from magfold_env.minimiser.every_sequence import (
    LONGEST_OF_ALL,
    EverySequence,
    every_ground_state,
    sequence_of,
)
from magfold_env.minimiser.search import Minimum, Mode, ground_state, minimise
from magfold_env.minimiser.states import Among, State

__all__ = [
    "LONGEST_OF_ALL",
    "Among",
    "EverySequence",
    "Minimum",
    "Mode",
    "State",
    "every_ground_state",
    "ground_state",
    "minimise",
    "refuse_field",
    "sequence_of",
    "strengths",
]
