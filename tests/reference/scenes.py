"""Scenes for the second simulator, with obstacles or with feeds that reverse."""

from __future__ import annotations

from typing import Any

import numpy as np

import magfold_env as mf
from magfold_bench.laws.random_scenes import designed_sequence

DIAGONAL = mf.Casing().diagonal
SPEED = 0.1  # [m/s]


def chain(rng: np.random.Generator, number: int) -> mf.Scene:
    """Return one of the paper's sequences for every third number, else one designed for a word."""
    if number % 3 == 0:
        sequence = mf.load_scene(f"paper/sequence-{rng.integers(1, 4)}").sequence
    else:
        sequence = designed_sequence(rng, int(rng.integers(4, 7)))
    return mf.Scene(sequence=sequence, friction=rng.uniform(0.1, 0.35))


def among_obstacles(number: int) -> mf.Scene:
    """Return a scene with posts, a channel or a chamber, fed forward, backward or free."""
    rng = np.random.default_rng([number, 0x0B57])
    scene = chain(rng, number // 2)
    n, mount = scene.n, ("forward", "backward", "free")[number // 3 % 3]
    tube = mount != "free"
    if number % 3 == 0:
        nearest = 0.9 if tube else 1.0  # [diagonals] from the axis
        obstacles = tuple(
            mf.Rectangle(
                position=tuple(
                    DIAGONAL * np.array([rng.uniform(1.3, 3.5), side * rng.uniform(nearest, 1.6)])
                ),
                size=tuple(DIAGONAL * rng.uniform(0.2, 0.5, 2)),
                heading=rng.uniform(-np.pi, np.pi),
            )
            for side in (1.0, -1.0)
        )
    elif number % 3 == 1:
        ends = (1.1, rng.uniform(2.0, 3.0)) if tube else (rng.uniform(0.0, 2.0), n)
        obstacles = mf.channel(
            (ends[0] * DIAGONAL, 0.0), (ends[1] * DIAGONAL, 0.0), rng.uniform(1.3, 2.0) * DIAGONAL
        )
    else:
        left, length = (1.1, rng.uniform(3.5, 4.5)) if tube else (-0.3, n + 0.6)
        height = rng.uniform(2.8, 4.0)
        obstacles = mf.chamber(
            (left * DIAGONAL, -0.5 * height * DIAGONAL),
            (length * DIAGONAL, height * DIAGONAL),
            (2.2 if tube else 1.3) * DIAGONAL,
        )
    changes: dict[str, Any] = {"obstacles": obstacles, "mount": "tube" if tube else "free"}
    if tube:
        changes["feed"] = {"direction": mount, "speed": SPEED}
    return scene.replace(**changes).draw(rng)


def there_and_back(number: int) -> mf.Scene:
    """Return a scene that pushes, pulls and pushes again; every second one has a funnel."""
    rng = np.random.default_rng([number, 0xBAC2])
    scene = chain(rng, number)
    out = rng.uniform(1.5, scene.n - 0.5)  # [diagonals]
    back = rng.uniform(0.5, out)
    again = rng.uniform(1.0, scene.n)
    bore = rng.uniform(1.15, 1.35) * DIAGONAL  # else what has folded locks at the rim
    second = DIAGONAL / SPEED
    feed = {
        "direction": ("forward", "backward")[number % 2],
        "bore": bore,
        "schedule": {
            "time": [
                [out * second, SPEED], [0.1, 0.0], [back * second, -SPEED], [again * second, SPEED],
            ]
        },
    }  # fmt: skip
    obstacles = mf.funnel(bore, length=0.02) if number // 2 % 2 else ()
    return scene.replace(mount="tube", feed=feed, obstacles=obstacles).draw(rng)
