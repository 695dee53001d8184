"""Random variation of the physics between episodes, and fixed draws.

A fixed draw is a seed for ``env.reset``; no two purposes share a seed. Results are compared on the
same draws, which training never uses: training seeds are below 2³², and the seeds defined here are
above 2⁶⁴.
"""

from typing import Literal
from zlib import crc32

import numpy as np

from magfold_env.envs.tasks.checks import one_of
from magfold_env.scene import Problem, Scene, Spreads
from magfold_env.scene.errors import refuse

EVALUATION_VERSION = 3
"""Version of the draws on which results are reported. It changes when `evaluation_seeds` changes or
when an environment draws differently for a seed; a test checks both."""

_RESERVED = 1 << 64


def episode_seeds(stream: str, count: int) -> list[int]:
    """Return the first `count` seeds of a stream, named for a purpose such as ``validation``."""
    seeds: list[int] = []
    for index in range(count):
        key = (crc32(stream.encode()), index)
        word = np.random.SeedSequence(0, spawn_key=key).generate_state(1, np.uint64)[0]
        seeds.append(_RESERVED + int(word))
    return seeds


def evaluation_seeds(count: int) -> list[int]:
    """Return the seeds of the evaluation draws; use each one once per target or task."""
    return episode_seeds("evaluation", count)


Randomisation = Literal["none", "nominal", "strong", "scene"]
"""``none``: the same physics every time. ``nominal``, ``strong``: the spreads in `PRESETS`.
``scene``: the scene's own spreads, including those of masses and single magnets."""

PRESETS: dict[str, tuple[Spreads, float]] = {
    "none": (Spreads(), 0.0),
    "nominal": (Spreads(friction=0.10, remanence=0.05, feed_jitter=0.05), 0.03),
    "strong": (Spreads(friction=0.30, remanence=0.10, feed_jitter=0.20), 0.1),
}
"""Relative half-widths of the uniform draws, and the largest joint angle at release [rad], which
the bore may limit further. Feed jitter varies the speed at which each component leaves."""


def randomised(scene: Scene, randomisation: Randomisation) -> Scene:
    """Return `scene` with the spreads of `randomisation`."""
    one_of("randomisation", randomisation, Randomisation)
    allowed = "environments draw no {}; must be {}"
    if scene.bumps is not None and scene.bumps.seed is None:
        refuse([Problem("bumps.seed", None, allowed.format("trains of bumps", "given"))])
    if randomisation == "scene":
        sizes = {f"spreads.{name}": getattr(scene.spreads, name) for name in ("side", "inset")}
        refuse(
            [
                Problem(key, value, allowed.format("sizes", "0"))
                for key, value in sizes.items()
                if value > 0.0
            ]
        )
        return scene
    spreads, angle = PRESETS[randomisation]
    changes = {} if angle == 0.0 else {"start_angles": None}
    return scene.replace(spreads=spreads, start_angle_spread=angle, **changes)
