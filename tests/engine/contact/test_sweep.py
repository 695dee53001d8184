"""Tests that the sweep misses no contact within a step, against fine sampling of the motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magfold_env.engine.contact import events, sweep
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Rectangle, Scene
from magfold_env.simulation.pack import pack

SIDE = 0.0125
SAMPLES = 1000
seeds = st.integers(0, 2**32 - 1)


class Moving:
    """A random chain, random solids and a random motion of the chain."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.n = int(rng.integers(1, 8))
        self.thin = float(np.exp(rng.uniform(np.log(2e-4), np.log(0.01))))
        solids = [
            Rectangle(
                position=tuple(rng.uniform([-0.02, -0.06], [0.018 * self.n + 0.02, 0.06])),
                size=(float(rng.choice([self.thin, 0.03])), self.thin),
                heading=float(rng.uniform(-math.pi, math.pi)),
            )
            for _ in range(int(rng.integers(0, 4)))
        ]
        angles = tuple(rng.uniform(-1.5, 1.5, self.n - 1))
        scene = Scene(sequence=("----",) * self.n, magnets=None, start_angles=angles)
        self.model = pack(scene.replace(obstacles=solids))
        self.state = new_state(self.model, np.cumsum([rng.uniform(-3.0, 3.0), *angles]))
        self.work = new_work(self.model)
        scale = np.exp(rng.uniform(np.log(1e-3), 0.0)) * np.array([1.0, 0.3, 0.1, 0.03])
        path = rng.normal(size=(4, self.n + 2)) * scale[:, None]
        path[:, self.n :] *= 2.0 * SIDE
        self.work.sweep.path[:] = path
        sweep.find_bounds(self.model, self.work)

    def coordinates(self, t: float) -> np.ndarray:
        out = np.empty(self.n + 2)
        sweep.coordinates_at(self.model, self.state, t, out, self.work)
        return out

    def margin(self, t: float) -> float:
        """Return the smallest margin of squares and joints, which is negative for overlaps."""
        q = self.coordinates(t)
        return float(events.margin(self.model, self.state, q, self.work))

    def missed(self) -> tuple[float, float, float]:
        # The boxes are to be placed anywhere on the way.
        self.margin(1.0)
        squares = sweep.may_meet(self.model, self.state, self.work)
        return events.first_missed(self.model, self.state, squares, True, self.work)


@settings(max_examples=40)
@given(seeds)
def test_what_a_fine_sampling_finds_is_not_missed(seed: int) -> None:
    case = Moving(seed)
    times = np.linspace(0.0, 1.0, SAMPLES)
    margins = np.array([case.margin(t) for t in times])
    if margins[0] < 0.0:
        return
    begin, end, value = case.missed()
    # Joints are judged in radians, squares in sides; both may go past a little unseen.
    deep = times[margins < -2.0 * max(sweep.SUNK, sweep.PAST * case.model.tolerance)]
    if value < 0.0:
        assert case.margin(end) == pytest.approx(value, abs=1e-12)
        assert case.margin(begin) > -2.0 * sweep.SUNK
        assert len(deep) == 0 or end <= deep[0] + 1.0 / SAMPLES
    else:
        # What touches at the end was looked at there.
        assert len(deep) == 0 or margins[-1] < 0.0


@settings(max_examples=60)
@given(seeds)
def test_bounds_hold_all_along_the_way(seed: int) -> None:
    case = Moving(seed)
    times = np.linspace(0.0, 1.0, 400)
    states = np.array([case.coordinates(t) for t in times])
    n, sweeps, length = case.n, case.work.sweep, float(case.model.bodies.length[0])
    links = length * np.exp(1j * states[:, :n])
    hinges = states[:, n] + 1j * states[:, n + 1]
    centres = hinges[:, None] + np.cumsum(links, axis=1) - 0.5 * links
    step = times[1] - times[0]
    for values, first, second in (
        (states[:, :n], sweeps.turn, sweeps.twist),
        (centres, sweeps.way, sweeps.bend),
    ):
        rates = np.abs(np.diff(values, axis=0)) / step
        bends = np.abs(np.diff(values, 2, axis=0)) / step**2
        assert (rates.max(axis=0) <= first * (1.0 + 1e-9)).all()
        assert (bends.max(axis=0) <= second * (1.0 + 1e-6) + 1e-9).all()
    for i in range(n):
        for j in set(range(n)) - {i}:
            seen = (centres[:, j] - centres[:, i]) * np.exp(-1j * states[:, i])
            way, bend = sweep.between(case.model, case.work, i, j)
            coarse = sweep.reach(case.model, case.work, min(i, j), max(i, j), 1.0) - length
            assert np.abs(np.diff(seen)).max() / step <= min(way, coarse) * (1.0 + 1e-9)
            assert np.abs(np.diff(seen, 2)).max() / step**2 <= bend * (1.0 + 1e-6) + 1e-9
