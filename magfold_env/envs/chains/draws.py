"""What is drawn for many chains at once: `Scene.draw` as arrays, without a scene for each.

The numbers and their order are those of `magfold_env.scene.Scene.draw`, and what becomes of them is
what `magfold_env.simulation.pack.pack` makes of the drawn scene, bit for bit; tests hold both to
that.
"""

import math
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from magfold_env.engine import entries as at
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.scene import Scene
from magfold_env.scene.base import MU0
from magfold_env.simulation.chains import Chains
from magfold_env.simulation.pack import pack, reversed_inside, typical_rate
from magfold_env.simulation.start import hinge_offsets

REFERENCE_SPEED = 0.1
"""Speed [m/s] that the scene's draw is applied to, to learn the factors it draws."""


class DrawnChains:
    """Chains of which every run differs in what is drawn.

    Parameters
    ----------
    templates : sequence of Scene
        Tube scenes that chains are drawn from, each run from one of them. They may differ in the
        direction of feed; their feed speeds and sequences do not count.
    count : int
        How many chains.
    threads : int
        How many threads feed them.
    frame_rate : float, optional
        Frames that are recorded a simulated second [1/s], of a single chain; they change nothing.
    endless : bool
        Whether chains that are all out may take longer to settle than the scenes allow.
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
        self._given = [_given_offsets(each) for each in self.templates]
        self.chains = Chains(packed, count, threads, frame_rate)
        jitters = spreads.feed_jitter > 0.0 or spreads.magnet > 0.0
        self._first = 0 if template.is_concrete else 2 * n + 4
        self._rest = 5 * n if jitters else 0
        last = 2 * (spreads.moves_obstacles + (spreads.tilt > 0.0))
        self._numbers = np.zeros((count, self._first + self._rest + last))
        self.strengths = np.empty((count, n, 4))
        """Charge of every pole face [A·m], component 1 first."""
        self.strengths[:] = template.magnets.charges(n) if template.magnets else np.ones(4)
        self.factors = np.ones((count, n))
        """What feed speeds are multiplied by, component 1 first."""

    def flip(self, row: int) -> bool:
        """Return whether the engine counts a chain's components from its end."""
        return bool(self.flips[self.chains.kind[row]])

    def draw(self, rows: Ints, rngs: Sequence[np.random.Generator], kind: int = 0) -> None:
        """Draw anew for some chains of a template, each from its own source, and begin."""
        if self._first:
            for row in rows.tolist():
                cast("Any", rngs[row]).random(out=self._numbers[row])
        self._begin(rows, kind)

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain."""
        again = cast("np.random.Generator", _Again(self._numbers[row]))
        return self.templates[int(self.chains.kind[row])].draw(again)

    def drive_as(self, scene: Scene) -> None:
        """Let what drives make of the speeds asked for be as in a scene that was drawn before."""
        self.factors[:] = scene.speeds / REFERENCE_SPEED

    def contents(self) -> tuple[Any, ...]:
        """Return all that decides how the chains go on."""
        return self.chains.kind.copy(), self._numbers.copy(), *self.chains.contents()

    def refill(self, contents: tuple[Any, ...]) -> None:
        """Go back to what `contents` returned."""
        kinds, self._numbers[:], *rest = contents
        for kind in np.unique(kinds).tolist():
            self._begin(np.flatnonzero(kinds == kind), kind)
        self.chains.refill(tuple(rest))

    def _begin(self, rows: Ints, kind: int) -> None:
        """Put some chains of a template into the tube, with the numbers drawn for them."""
        self.chains.clear(rows, kind)
        if self._first:
            self._take(rows)
        self.chains.charge[rows] = self.chains.waiting[rows] = 0.0
        self.chains.start(rows, self._offsets(rows))

    def _take(self, rows: Ints) -> None:
        """Turn numbers drawn from [0, 1) into what they stand for."""
        scene, chains, flip = self.templates[0], self.chains, self.flip(rows[0])
        n, spreads = scene.n, scene.spreads
        unit = 2.0 * self._numbers[rows] - 1.0
        rest = self._first + self._rest
        each = unit[:, self._first : rest].reshape(len(rows), -1, n)
        friction = scene.frictions * spreads.friction_factor(unit[:, :1])
        normal, pull = np.full(len(rows), scene.gravity.normal), None
        if spreads.tilt > 0.0:
            normal, pull = spreads.tilted(scene.gravity, unit[:, -2:])
            for gravity, along in zip(chains.gravity, pull.T, strict=True):
                gravity[rows] = along
        mass = np.broadcast_to(scene.masses, (len(rows), n))
        if spreads.mass > 0.0:
            factors = 1.0 + spreads.mass * unit[:, 1 : n + 1]
            mass = scene.masses * factors
            inertia = mass * (scene.casing.side * scene.casing.side) / 6.0
            if scene.casing.inertia is not None:
                inertia = scene.inertias * factors
            chains.mass[rows] = mass[:, ::-1] if flip else mass
            chains.inertia[rows] = inertia[:, ::-1] if flip else inertia
        grip = friction * normal[:, None] * mass
        mass, grip = (mass[:, ::-1], grip[:, ::-1]) if flip else (mass, grip)
        chains.grip[rows] = grip
        strength = (1.0 + spreads.remanence * unit[:, n + 1])[:, None, None]
        speed = (1.0 + spreads.feed_speed * unit[:, n + 2])[:, None]
        if spreads.feed_jitter > 0.0:
            speed = speed * (1.0 + spreads.feed_jitter * each[:, 0])
        if spreads.magnet > 0.0:
            strength = strength * (1.0 + spreads.magnet * each[:, 1:].reshape(-1, n, 4))
        if max(spreads.feed_speed, spreads.feed_jitter) > 0.0:
            self.factors[rows] = REFERENCE_SPEED * speed / REFERENCE_SPEED
        if max(spreads.remanence, spreads.magnet) > 0.0:
            self.strengths[rows] = self._charges(strength)
        if spreads.moves_obstacles:
            y = np.array([obstacle.position[1] for obstacle in scene.obstacles])
            places = spreads.obstacle_places(y, unit[:, rest : rest + 2])
            first = chains.obstacles.shape[1] - y.size
            chains.obstacles[rows, first:, at.Y] = places
        strongest, mass = self.strengths[rows].max(axis=(1, 2)), np.ascontiguousarray(mass)
        chains.rate_scale[rows] = typical_rate(scene, strongest, mass.mean(axis=1), pull)
        chains.light_rate[rows] = typical_rate(scene, strongest, mass.min(axis=1), pull)

    def _charges(self, factors: Floats) -> Floats:
        """Return charges of pole faces [A·m] for the factors of their strengths."""
        magnets = self.templates[0].magnets
        assert magnets is not None
        charges = np.asarray(getattr(magnets, magnets.strength_name)) * factors
        if magnets.pole_charge is None:
            charges = charges * magnets.by_face("width") * magnets.by_face("height") / MU0
        return charges

    def _offsets(self, rows: Ints) -> Floats:
        """Return how far from the axis hinges lie at first [m], (rows, n + 1), inner end first."""
        scene, n = self.templates[0], self.templates[0].n
        given = self._given[int(self.chains.kind[rows[0]])]
        if given is not None:
            return np.repeat(given[None], len(rows), axis=0)
        unit = 2.0 * self._numbers[rows, n + 3 : 2 * n + 4] - 1.0
        offsets = scene.start_offset_spread * unit + 0.0
        return np.ascontiguousarray(offsets[:, ::-1]) if self.flip(rows[0]) else offsets


class _Again:
    """Numbers that have been drawn already, for `Scene.draw` to draw again."""

    def __init__(self, numbers: Floats) -> None:
        self._left = numbers

    def random(self, size: int | tuple[int, ...]) -> Floats:
        """Return the next numbers."""
        count = int(np.prod(size))
        numbers, self._left = self._left[:count], self._left[count:]
        return numbers.reshape(size)


def _given_offsets(template: Scene) -> Floats | None:
    """Return where hinges lie at first [m], (n + 1,), inner end first; None if that is drawn."""
    if template.start_angles is None and template.start_offsets is None:
        return None
    offsets = hinge_offsets(template)
    return offsets[::-1] if reversed_inside(template) else offsets


def _nothing_drawn(template: Scene) -> Scene:
    """Return a concrete scene with a magnet behind every face."""
    spreads = dict.fromkeys(type(template.spreads).model_fields, 0.0)
    sequence = (PATTERNS[0],) * template.n
    straight = (0.0,) * (template.n - 1)
    return template.replace(spreads=spreads, start_angles=straight, sequence=sequence)
