"""The scenes of this benchmark: the paper's sequences and random ones, as if released by hand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from magfold_env.ensembles import release
from magfold_env.minimiser import Mode
from magfold_env.scene import Scene, Spreads, load_scene

MODES: tuple[Mode, ...] = ("free", "forward", "backward")
SEQUENCES = (1, 2, 3)
COMPONENTS = 6

SPEED = 0.05
"""Feed speed [m/s]; the paper says constant, and by hand."""

SPREADS = Spreads(
    friction=0.2, mass=0.05, remanence=0.05, feed_speed=0.3, feed_jitter=0.2, magnet=0.05
)
"""Assumed: what varies from one release by hand to the next. The paper gives no figures."""

ANGLE = 0.1
"""Assumed: half-width of the joint angles at release [rad].

The paper's chain is 3 mm from its model at the start, on average, because its hinges are strings.
"""


def by_hand(scene: Scene, mode: Mode) -> Scene:
    """Return a scene as it is released by hand in one of the modes."""
    varied = scene.replace(spreads=SPREADS, start_angle_spread=ANGLE, start_angles=None)
    return release(varied, mode, SPEED)


def paper_scene(sequence: int, mode: Mode) -> Scene:
    """Return one of the paper's sequences, as it is released by hand."""
    return by_hand(load_scene(f"paper/sequence-{sequence}"), mode)


def random_scenes(count: int, mode: Mode) -> Iterator[Scene]:
    """Yield random sequences of six, the same in every mode."""
    rng = np.random.default_rng(0)
    for _ in range(count):
        letters = rng.choice(["N", "S"], size=(COMPONENTS, 4))
        sequence = tuple("".join(row) for row in letters)
        yield by_hand(load_scene("paper/sequence-1").replace(sequence=sequence), mode)
