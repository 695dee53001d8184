"""What is drawn for many chains at once: `Scene.draw` as arrays, without a scene for each.

The numbers and their order are those of `magfold_env.scene.Scene.draw`, and what becomes of them is
what `magfold_env.simulation.pack.pack` makes of the drawn scene, bit for bit; tests hold both to
that.
"""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.dynamic_episode import REFERENCE_SPEED
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.scene import Scene
from magfold_env.scene.base import MU0
from magfold_env.simulation.chains import Chains
from magfold_env.simulation.pack import TURNED, pack, reversed_inside, typical_rate

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class DrawnChains:
    """Chains of one scene, of which every run differs in what is drawn.

    Parameters
    ----------
    template : Scene
        What `magfold_env.envs.chains.dynamic_episode.dynamic_template` returns.
    count : int
        How many.
    threads : int
        How many threads feed them.
    """

    def __init__(self, template: Scene, count: int, threads: int) -> None:
        self.template = template
        self.flip = reversed_inside(template)
        self.built = template.feed.loading == "preloaded"
        n = template.n
        drawn = _nothing_drawn(template)
        self.chains = Chains(pack(drawn), count, threads)
        spreads = template.spreads
        jitters = spreads.feed_jitter > 0.0 or spreads.magnet > 0.0
        self._first = 0 if template.is_concrete else 2 * n + 2
        self._rest = 5 if jitters else 0
        self._numbers = np.zeros((count, self._first + self._rest * n))
        self.strengths = np.empty((count, n, 4))
        """Charge of every pole face [A·m], component 1 first."""
        self.strengths[:] = np.ones(4) if drawn.magnets is None else drawn.magnets.charges(n)
        self.factors = np.ones((count, n))
        """What feed speeds are multiplied by, component 1 first."""

    def draw(self, rows: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Draw anew for some chains, each from its own source, and put them into the tube."""
        if self._first:
            for row in rows.tolist():
                cast("Any", rngs[row]).random(out=self._numbers[row])
            self._take(rows)
        headings = self._headings(rows)
        self.chains.charge[rows] = 0.0
        self.chains.restart(rows, headings)

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain."""
        return self.template.draw(cast("np.random.Generator", _Again(self._numbers[row])))

    def magnetise(self, rows: Ints, signs: Floats, speeds: Floats) -> None:
        """Choose the magnets of whole chains, (rows, n, 4), and a feed speed for each [m/s]."""
        charges = signs * self.strengths[rows]
        factors = speeds[:, None] * self.factors[rows]
        if self.flip:
            charges, factors = charges[:, ::-1, TURNED], factors[:, ::-1]
        self.chains.waiting[rows], self.chains.speeds[rows] = charges, factors
        if self.built:
            self.chains.charge[rows] = charges

    def _take(self, rows: Ints) -> None:
        """Turn numbers drawn from [0, 1) into what they stand for."""
        scene, n, chains, spreads = (
            self.template,
            self.template.n,
            self.chains,
            self.template.spreads,
        )
        unit = 2.0 * self._numbers[rows] - 1.0
        each = unit[:, self._first :].reshape(len(rows), self._rest, n)
        friction = scene.friction * (1.0 + spreads.friction * unit[:, 0])
        mass = np.broadcast_to(scene.masses, (len(rows), n))
        if spreads.mass > 0.0:
            factors = 1.0 + spreads.mass * unit[:, 1 : n + 1]
            mass = scene.masses * factors
            inertia = mass * scene.casing.side**2 / 6.0
            if scene.casing.inertia is not None:
                inertia = scene.inertias * factors
            mass, inertia = (x[:, ::-1] if self.flip else x for x in (mass, inertia))
            chains.mass[rows], chains.inertia[rows] = mass, inertia
        chains.grip[rows] = (friction * scene.gravity.normal)[:, None] * mass
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
        strongest, mass = self.strengths[rows].max(axis=(1, 2)), np.ascontiguousarray(mass)
        chains.rate_scale[rows] = typical_rate(scene, strongest, mass.mean(axis=1))
        chains.light_rate[rows] = typical_rate(scene, strongest, mass.min(axis=1))

    def _charges(self, factors: Floats) -> Floats:
        """Return charges of pole faces [A·m] for the factors of their strengths."""
        magnets = self.template.magnets
        assert magnets is not None
        charges = np.asarray(getattr(magnets, magnets.strength_name)) * factors
        if magnets.pole_charge is None:
            charges = charges * magnets.by_face("width") * magnets.by_face("height") / MU0
        return charges

    def _headings(self, rows: Ints) -> Floats:
        """Return the headings at release in the engine's order [rad], (rows, n)."""
        scene, n = self.template, self.template.n
        if scene.start_angles is None:
            unit = 2.0 * self._numbers[rows, n + 3 : 2 * n + 2] - 1.0
            joints = scene.start_angle_spread * unit + 0.0
        else:
            joints = np.broadcast_to(np.asarray(scene.start_angles), (len(rows), n - 1))
        if self.flip:
            joints = -joints[:, ::-1]
        headings = np.concatenate([np.zeros((len(rows), 1)), np.cumsum(joints, axis=1)], axis=1)
        return headings - headings.mean(axis=1, keepdims=True)


class _Again:
    """Numbers that have been drawn already, for `Scene.draw` to draw again."""

    def __init__(self, numbers: Floats) -> None:
        self._left = numbers

    def random(self, size: int | tuple[int, ...]) -> Floats:
        """Return the next numbers."""
        count = int(np.prod(size))
        numbers, self._left = self._left[:count], self._left[count:]
        return numbers.reshape(size)


def _nothing_drawn(template: Scene) -> Scene:
    """Return a concrete scene with a magnet behind every face."""
    angles = (0.0,) * (template.n - 1) if template.start_angles is None else template.start_angles
    spreads = dict.fromkeys(type(template.spreads).model_fields, 0.0)
    sequence = (PATTERNS[0],) * template.n
    return template.replace(spreads=spreads, start_angles=angles, sequence=sequence)
