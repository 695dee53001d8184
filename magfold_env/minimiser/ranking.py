"""States in the order of their energies."""

from __future__ import annotations

import numpy as np

from magfold_env.minimiser.landscape import Floats
from magfold_env.minimiser.lattice import Ints


def ranked(energies: Floats, tie: float) -> list[Ints]:
    """Return indices by ascending energy, in groups that lie within `tie` of the next [J].

    Within a group the given order stays.
    """
    order = np.argsort(energies, kind="stable")
    steps = np.diff(energies[order]) > tie
    return [np.sort(group) for group in np.split(order, np.flatnonzero(steps) + 1)]
