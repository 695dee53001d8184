"""How often the other predictors name the ground state."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from magfold_env.benchmarks.energy.scenes import random_scene
from magfold_env.minimiser import Mode, descend, ground_state, minimise
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene
from magfold_env.shapes import headings

NAME = "predictors"
LENGTHS = (6, 10, 14)
SEED = 5
FEEDS: tuple[Mode, ...] = ("forward", "backward")


def run(quick: bool, progress: Progress) -> Measurement:
    """Compare feeds and descents with the proved ground states of random sequences."""
    count = 5 if quick else 60
    rng = np.random.default_rng(SEED)
    rows: list[Row] = []
    for n in LENGTHS[:2] if quick else LENGTHS:
        hits = dict.fromkeys([*FEEDS, "descent"], 0)
        for k in range(count):
            progress((len(rows) + k / count) / len(LENGTHS), f"{n} components")
            scene = random_scene(rng, n)
            lowest = ground_state(scene).best.word
            for feed in FEEDS:
                hits[feed] += _fed(scene, feed) == lowest
            spread = scene.start_angle_spread
            start = headings(rng.uniform(-spread, spread, n - 1))
            hits["descent"] += descend(scene, start).word == lowest
        rows.append({"components": n, **{name: hit / count for name, hit in hits.items()}})
    table = Table(f"share of {count} random sequences whose ground state is named", rows)
    return Measurement(NAME, rows, [table])


def _fed(scene: Scene, mode: Mode) -> str | None:
    """Return the word of a component-by-component search, None if it shuts itself in."""
    with suppress(ValueError):
        return minimise(scene, mode).best.word
    return None
