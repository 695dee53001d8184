"""Random sequences with the device's magnets."""

from __future__ import annotations

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.scene import Scene


def random_signs(rng: np.random.Generator, count: int, n: int) -> Array:
    """Return the poles of some sequences of n components, +1 and -1, shape (count, n, 4)."""
    return rng.choice([-1.0, 1.0], (count, n, 4))


def random_scene(rng: np.random.Generator, n: int) -> Scene:
    """Return a chain of n components with random poles."""
    faces = np.where(random_signs(rng, 1, n)[0] > 0.0, "N", "S")
    return Scene(sequence=tuple("".join(component) for component in faces))
