"""What friction holds stays where it is, to the last bit."""

from __future__ import annotations

import numpy as np

from magfold_env.fold import FoldStatus
from magfold_env.laws.random_scenes import random_scene
from magfold_env.laws.stepping import SteppedSession

WAIT = 1000.0  # [s]
LEAST_FRICTION = 0.2


def creep(seed: int) -> float | None:
    """Return how far a fold that came to rest moves in a thousand seconds [rad].

    Positions count in lengths of a component. None if the scene never comes to rest.
    """
    scene = random_scene(seed)
    scene = scene.replace(friction=max(scene.friction, LEAST_FRICTION))
    session = SteppedSession(scene)
    session.run()
    if session.status not in {FoldStatus.FOLDED, FoldStatus.MISFOLDED}:
        return None
    angles, base = session.angles, session.base
    session.wait(WAIT)
    moved = float(np.abs(session.base - base).max()) / scene.casing.diagonal
    return max(float(np.abs(session.angles - angles).max()), moved)
