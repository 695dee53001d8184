"""Draws for many chains at once: `Scene.draw` as arrays, without a scene for each chain.

The numbers and their order are those of `magfold_env.scene.Scene.draw`; the results equal those of
`magfold_env.simulation.pack.pack` for the drawn scene, bit for bit.
"""

import math
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from magfold_env.engine import entries as at
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.scene import Scene
from magfold_env.scene.numbers import square_inertia
from magfold_env.simulation.chains import Chains
from magfold_env.simulation.pack import Values, inner_offsets, numbers, pack, reversed_inside

REFERENCE_SPEED = 0.1
"""Speed [m/s] that the scene's draw is applied to, to find the drawn factors."""


class DrawnChains:
    """Chains whose every run has its own draws.

    Parameters
    ----------
    templates : sequence of Scene
        Tube scenes that chains are drawn from, each run from one of them. They may differ in the
        direction of feed; their feed speeds and sequences do not count.
    count : int
        Number of chains.
    threads : int
        Number of threads that feed them.
    frame_rate : float, optional
        Frames recorded per simulated second [1/s], for a single chain; they do not change results.
    endless : bool
        Whether chains that are completely out may take longer to settle than the scenes allow.
    """

    def __init__(
        self,
        templates: Sequence[Scene],
        count: int,
        threads: int = 1,
        frame_rate: float | None = None,
        *,
        endless: bool = False,
    ) -> None:
        fed = {"speed": (REFERENCE_SPEED,) * templates[0].n, "schedule": None}
        self.templates = [template.replace(feed=fed) for template in templates]
        template = self.templates[0]
        self.flips = np.array([reversed_inside(each) for each in templates])
        self.built = template.feed.loading == "preloaded"
        n, spreads = template.n, template.spreads
        packed = [pack(_nothing_drawn(each)) for each in self.templates]
        if endless:
            packed = [model._replace(duration=math.inf) for model in packed]
        given = template.start_angles is not None or template.start_offsets is not None
        self._given = [inner_offsets(each) for each in self.templates] if given else None
        self.chains = Chains(packed, count, threads, frame_rate)
        self._first = 0 if template.is_concrete else 2 * n + 4 + 5 * n * spreads.one_by_one
        last = 2 * (spreads.moves_obstacles + (spreads.tilt > 0.0))
        self._numbers = np.zeros((count, self._first + last))
        self.strengths = np.empty((count, n, 4))
        """Charge of every pole face [A·m], component 1 first."""
        self.strengths[:] = template.magnets.charges(n) if template.magnets else np.ones(4)
        self.factors = np.ones((count, n))
        """Factors of the feed speeds, component 1 first."""

    def flip(self, row: int) -> bool:
        """Return whether the engine counts a chain's components from its end."""
        return bool(self.flips[self.chains.kind[row]])

    def draw(self, rows: Ints, rngs: Sequence[np.random.Generator], kind: int = 0) -> None:
        """Make new draws for some chains of a template, each from its own source, and begin."""
        if self._first:
            for row in rows.tolist():
                cast("Any", rngs[row]).random(out=self._numbers[row])
        self._begin(rows, kind)

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain."""
        again = cast("np.random.Generator", _Again(self._numbers[row]))
        return self.templates[int(self.chains.kind[row])].draw(again)

    def drive_as(self, scene: Scene) -> None:
        """Take the factors of the feed speeds from a scene that was drawn before."""
        self.factors[:] = scene.speeds / REFERENCE_SPEED

    def contents(self) -> tuple[Any, ...]:
        """Return the complete state of the chains."""
        return self.chains.kind.copy(), self._numbers.copy(), *self.chains.contents()

    def refill(self, contents: tuple[Any, ...]) -> None:
        """Restore a state that `contents` returned."""
        kinds, self._numbers[:], *rest = contents
        for kind in np.unique(kinds).tolist():
            self._begin(np.flatnonzero(kinds == kind), kind)
        self.chains.refill(tuple(rest))

    def _begin(self, rows: Ints, kind: int) -> None:
        """Put some chains of a template into the tube, using the numbers drawn for them."""
        self.chains.clear(rows, kind)
        if self._first:
            self._take(rows, kind)
        self.chains.charge[rows] = self.chains.waiting[rows] = 0.0
        self.chains.start(rows, self._offsets(rows))

    def _take(self, rows: Ints, kind: int) -> None:
        """Convert numbers drawn from [0, 1) to physical values."""
        scene, chains = self.templates[kind], self.chains
        n, spreads = scene.n, scene.spreads
        unit = 2.0 * self._numbers[rows] - 1.0
        factors = spreads.factors(n, unit[:, : self._first])
        if max(spreads.feed_speed, spreads.feed_jitter) > 0.0:
            speed = factors.speed.reshape(len(rows), -1)
            self.factors[rows] = REFERENCE_SPEED * speed / REFERENCE_SPEED
        if scene.magnets is not None:
            strength = factors.strength.reshape(len(rows), *(factors.strength.shape[1:] or (1, 1)))
            self.strengths[rows] = scene.magnets.charges(n, strength)
        if spreads.moves_obstacles:
            y = np.array([obstacle.position[1] for obstacle in scene.obstacles])
            places = spreads.obstacle_places(y, unit[:, self._first : self._first + 2])
            first = chains.obstacles.shape[1] - y.size
            chains.obstacles[rows, first:, at.Y] = places
        normal = np.full(len(rows), scene.gravity.normal)
        pull = np.full((len(rows), 2), scene.gravity.in_plane)
        if spreads.tilt > 0.0:
            normal, pull = spreads.tilted(scene.gravity, unit[:, -2:])
        mass = scene.masses * factors.mass
        inertia = square_inertia(mass, scene.casing.side)
        if scene.casing.inertia is not None:
            inertia = scene.inertias * factors.mass
        friction = scene.frictions * factors.friction[:, None]
        charge = self.strengths[rows].max(axis=(1, 2))
        values = Values(mass, inertia, friction, charge, normal, pull)
        chains.put(rows, numbers(scene, values))

    def _offsets(self, rows: Ints) -> Floats:
        """Return the initial offsets of hinges from the axis [m], (rows, n + 1), inner first."""
        scene, n = self.templates[0], self.templates[0].n
        if self._given is not None:
            given = self._given[int(self.chains.kind[rows[0]])]
            return np.repeat(given[None], len(rows), axis=0)
        unit = 2.0 * self._numbers[rows, n + 3 : 2 * n + 4] - 1.0
        offsets = scene.start_offset_spread * unit + 0.0
        return np.ascontiguousarray(offsets[:, ::-1]) if self.flip(rows[0]) else offsets


class _Again:
    """A source that returns numbers drawn earlier, so that `Scene.draw` repeats them."""

    def __init__(self, numbers: Floats) -> None:
        self._left = numbers

    def random(self, size: int | tuple[int, ...]) -> Floats:
        """Return the next numbers."""
        count = int(np.prod(size))
        numbers, self._left = self._left[:count], self._left[count:]
        return numbers.reshape(size)


def _nothing_drawn(template: Scene) -> Scene:
    """Return a concrete scene with a magnet behind every face."""
    spreads = dict.fromkeys(type(template.spreads).model_fields, 0.0)
    sequence = (PATTERNS[0],) * template.n
    straight = (0.0,) * (template.n - 1)
    return template.replace(spreads=spreads, start_angles=straight, sequence=sequence)
