"""Random pairs of casings for tests of the magnets benchmark."""

import numpy as np

from magfold_bench.magnets import samples
from magfold_env.scene import Scene

SIDE = 0.0125


def alike(seed):
    """Return two components with the default magnets, and their poses."""
    rng = np.random.default_rng(seed)
    return samples.random_scene(rng, 2), samples.random_pair(rng, SIDE)


def unequal(seed):
    """Return two components with random magnets and some empty faces, and their poses."""
    rng = np.random.default_rng(seed)
    magnets = {
        "remanence": rng.uniform(0.2, 1.4, (2, 4)), "width": rng.uniform(0.003, 0.006, 4),
        "height": rng.uniform(0.003, 0.008, 4), "thickness": rng.uniform(0.001, 0.002, 4),
        "inset": rng.uniform(0.0004, 0.001, 4),
    }  # fmt: skip
    sequence = tuple("".join(row) for row in rng.choice([*"NNSS-"], (2, 4)))
    return Scene(sequence=sequence).replace(magnets=magnets), samples.random_pair(rng, SIDE)
