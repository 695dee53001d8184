"""The state of every random number generator that is shared by a whole process."""

import random
from dataclasses import dataclass
from typing import Any

import numpy as np
from torch import Tensor, cuda, get_rng_state, set_rng_state


@dataclass(frozen=True)
class RandomState:
    """What Python's, NumPy's and torch's random numbers to come depend on."""

    python: Any
    numpy: Any
    torch: Tensor
    cuda: list[Tensor]


def random_state() -> RandomState:
    """Return the state of now."""
    return RandomState(
        random.getstate(),
        np.random.get_state(),  # noqa: NPY002 (what Stable-Baselines3 draws from)
        get_rng_state(),
        cuda.get_rng_state_all() if cuda.is_available() else [],
    )


def set_random_state(state: RandomState) -> None:
    """Go back to `state`."""
    random.setstate(state.python)
    np.random.set_state(state.numpy)  # noqa: NPY002
    set_rng_state(state.torch)
    if state.cuda:
        cuda.set_rng_state_all(state.cuda)
