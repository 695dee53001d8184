"""Random components for tasks."""

from typing import Any

import numpy as np

from magfold_env.envs.spaces.actions import PATTERNS


def random_faces(rng: np.random.Generator, size: int | tuple[int, int]) -> Any:
    """Return the faces of random components, nested in a given shape."""
    return np.array(PATTERNS)[rng.integers(len(PATTERNS), size=size)].tolist()
