"""The simulated chains of environments, each with its own random draws.

Draws use random numbers as `Scene.draw` does, but need no scene for each chain. The results equal
those of `magfold_env.simulation.pack.pack` for the drawn scene, bit for bit.
"""

import math
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.compile.by_pointer import pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.chains.arrays import (
    FAILED,
    STATUSES,
    UNSETTLED,
    Bools,
    ChainArrays,
    Floats,
    Ints,
    clear,
    component,
)
from magfold_env.envs.spaces.actions import PATTERNS, SIGNS, letters_of
from magfold_env.fold import Trajectory
from magfold_env.scene import Scene
from magfold_env.scene.numbers import square_inertia
from magfold_env.simulation.chains import Chains
from magfold_env.simulation.endings import ending, work_cap
from magfold_env.simulation.pack import (
    TURNED,
    Values,
    inner_offsets,
    numbers,
    pack,
    reversed_inside,
)
from magfold_env.simulation.view import Orientation, advances, public_states

REFERENCE_SPEED = 0.1
"""Feed speed of all templates [m/s]; a drawn speed divided by this is the drawn factor."""

_TURNED = tuple(TURNED)
_AS_DRAWN = np.ones(4)
_ROUNDING = 1e-9  # [s] tolerance for the time at which a chain stops


class DynamicChains:
    """Simulated chains, the counterpart of `magfold_env.envs.chains.quasistatic.QuasistaticChains`.

    Parameters
    ----------
    templates : sequence of Scene
        Tube scenes; each chain is drawn from one of them. They may differ in the direction of feed.
        Their feed speeds and sequences have no effect.
    count : int
        Number of chains.
    threads : int
        Number of threads that simulate.
    frame_rate : float, optional
        Frames recorded per simulated second [1/s], for a single chain. It does not change results.
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
        n, spreads = template.n, template.spreads
        packed = [pack(_nothing_drawn(each)) for each in self.templates]
        if endless:
            packed = [model._replace(duration=math.inf) for model in packed]
        given = template.start_angles is not None or template.start_offsets is not None
        self._given = [inner_offsets(each) for each in self.templates] if given else None
        self.engine = Chains(packed, count, threads, frame_rate)
        """The chains, with components in the engine's order."""
        self._first = 0 if template.is_concrete else 2 * n + 4 + 5 * n * spreads.one_by_one
        last = 2 * (spreads.moves_obstacles + (spreads.tilt > 0.0))
        self._numbers = np.zeros((count, self._first + last))
        self._hidden = hidden_places(template)
        self.strengths = np.empty((count, n, 4))
        """Charge of every pole face [A·m], component 1 first."""
        self.strengths[:] = template.magnets.charges(n) if template.magnets else np.ones(4)
        self.factors = np.ones((count, n))
        """Factors of the feed speeds, component 1 first."""
        self._length = self.engine.models[0].bodies.length
        # Whether the engine counts components from the chain's end, per template and per chain.
        self._flips = [reversed_inside(each) for each in templates]
        self._flip: Bools = np.zeros(count, dtype=np.bool_)
        self._messages = [""] * count
        self.arrays = ChainArrays.empty(count, n)
        self.seen = pointer(self.arrays)
        """A pointer to `arrays`, which makes calls of kernels fastest."""

    def begin(self, rows: Ints, rngs: Sequence[np.random.Generator], kind: int = 0) -> None:
        """Draw chains from template `kind`, row k with ``rngs[k]``, and put them into tubes."""
        if self._first:
            for row in rows.tolist():
                cast("Any", rngs[row]).random(out=self._numbers[row])
        self._put_in(rows, kind)
        self._flip[rows] = self._flips[kind]
        clear(rows, self._flips[kind], self.seen)
        self._sync_from_engine(rows)

    def _put_in(self, rows: Ints, kind: int) -> None:
        """Put chains of template `kind` into their tubes, using the numbers drawn for them."""
        self.engine.clear(rows, kind)
        if self._first:
            self._apply_draws(rows, kind)
        self.engine.charge[rows] = self.engine.waiting[rows] = 0.0
        self.engine.start(rows, self._offsets(rows, kind))

    def feed(
        self,
        rows: Ints,
        patterns: Ints,
        speeds: Floats,
        scaled: Floats,
        grades: Floats = _AS_DRAWN,
        until: float | Floats = math.inf,
    ) -> None:
        """Feed the next component of each chain, or all components; complete chains then settle.

        `patterns` (rows, components) are pattern numbers, component 1 first. `speeds` (rows,) are
        in m/s, and `scaled` (rows,) are the same on the log scale from −1 to 1. `grades` (rows, 4)
        are factors of the strengths of the next components' magnets. A feed that has not finished
        pauses at the time `until` [s].
        """
        chains = self.engine
        signs, whole = SIGNS.take(patterns, axis=0), patterns.shape[1] > 1
        if whole:
            self.load(rows, signs)
            self.arrays.speeds[rows] = scaled[:, None]
            self._set_speeds(rows, speeds)
        else:
            _choose(
                rows, signs, speeds, scaled, np.broadcast_to(grades, (len(rows), 4)), self.seen,
                self.strengths, self.factors, chains.waiting, chains.speeds,
            )  # fmt: skip
        until = np.broadcast_to(until, len(rows))
        again = chains.released[rows] >= self.arrays.fed[rows]
        if again.any():  # was drawn back, and is not held
            self._move(rows[again], speeds[again], -0.5 * _ROUNDING, until[again])
        chains.feed(rows[~again], whole=whole, until=until[~again])
        self._sync_from_engine(rows)

    def load(self, rows: Ints, signs: Floats) -> None:
        """Set all outward poles (rows, n, 4) of chains, which must have the same feed direction."""
        self.arrays.signs[rows] = signs
        self.arrays.fed[rows] = signs.shape[1]
        charges = signs * self.strengths[rows]
        if self._flip[rows[0]]:
            charges = charges[:, ::-1, TURNED]
        self.engine.waiting[rows] = charges
        if self.templates[0].feed.loading == "preloaded":
            self.engine.charge[rows] = charges

    def push(self, rows: Ints, speeds: Floats, seconds: float) -> Floats:
        """Feed chains at given speeds [m/s] for a time [s]; negative speeds pull back.

        Returns the mean forces of the drives over that time [N], (rows,).
        """
        chains = self.engine
        self._set_speeds(rows, speeds)
        before = chains.impulses[rows]
        chains.push(rows, seconds)
        self._sync_from_engine(rows)
        force = (chains.impulses[rows] - before) / seconds
        return np.where(self.arrays.status[rows] == FAILED, 0.0, force)

    def pull(self, rows: Ints, forces: Floats, seconds: float) -> None:
        """Apply forces [N], (rows, 2), to the parts of chains outside the tubes for a time [s].

        The feeds stand still.
        """
        chosen = self.engine.speeds[rows]
        self._set_speeds(rows, np.zeros(len(rows)))
        self.engine.pull(rows, forces, seconds)
        self.engine.speeds[rows] = chosen
        self._sync_from_engine(rows)

    def draw_back(self, rows: Ints, speeds: Floats, until: float) -> None:
        """Draw each chain's last released component back into the tube, at speeds [m/s].

        That component then has no magnets and may be chosen again, even if the tube does not hold
        it. The motion stops early if the chain's simulation ends, or at time ``until`` [s].
        """
        arrays, chains, n = self.arrays, self.engine, self.arrays.angles.shape[1]
        arrays.fed[rows] -= 1
        fed = arrays.fed[rows]
        last = np.where(arrays.forward[rows], fed, n - 1 - fed)
        arrays.signs[rows, last] = 0.0
        arrays.speeds[rows, last] = 0.0
        chains.waiting[rows, n - 1 - arrays.fed[rows]] = 0.0
        self._move(rows, -speeds, _ROUNDING, np.full(len(rows), until))
        self._sync_from_engine(rows)

    def _set_speeds(self, rows: Ints, speeds: Floats) -> None:
        """Set the requested feed speed [m/s] of each of the given chains, (rows,)."""
        factors = speeds[:, None] * self.factors[rows]
        flips = self._flip[rows][:, None]
        self.engine.speeds[rows] = np.where(flips, factors[:, ::-1], factors)

    def _move(self, rows: Ints, speeds: Floats, excess: float, until: Floats) -> None:
        """Move each feed until exactly the chosen components are out, and ``excess`` [s] longer.

        The motion stops early if the chain's simulation ends, or at time ``until`` [s].
        """
        chains, n, pitch, left = self.engine, self.arrays.angles.shape[1], self._length[0], rows
        chosen = chains.speeds[rows]
        self._set_speeds(rows, speeds)
        while len(left):
            inside = chains.released[left] - self.arrays.fed[left]  # to be drawn in
            way = -inside * pitch - chains.q[left, n]
            seconds = way / chains.speeds[left, n - 1 - chains.released[left]] + excess
            on = seconds > 0.1 * _ROUNDING
            left, until = left[on], until[on]
            chains.push(left, np.minimum(seconds[on], until - chains.times[left]))
            going = (chains.outcomes[left] == outcomes.REACHED) & (chains.times[left] < until)
            left, until = left[going], until[going]
        chains.speeds[rows] = chosen

    def times(self, rows: Ints) -> Floats:
        """Return the simulated times [s], (rows,)."""
        return self.engine.times[rows]

    def impulses(self, rows: Ints) -> Floats:
        """Return the impulses of the drives so far [N·s], (rows,)."""
        return self.engine.impulses[rows]

    def advances(self) -> Floats:
        """Return the feeds' advances [m], (m,); a released chain's advance is its length."""
        chains, out = self.engine, np.empty(self._flip.size)
        advances(self._length, chains.counters, chains.q, chains.depths, out)
        return out

    def acting(self, row: int) -> int:
        """Return how many components of a chain have magnets that act now."""
        return int(self.engine.charge[row].any(axis=1).sum())

    def stop(self, rows: Ints, message: str, status: int = UNSETTLED) -> None:
        """End the simulation of the given chains; their status is unsettled by default."""
        self.arrays.status[rows] = status
        for row in rows.tolist():
            self._messages[row] = message

    def energies(self, rows: Ints) -> Floats:
        """Return the magnetic energies [J]; NaN if a simulation failed."""
        chains, going = self.engine, rows[self.engine.outcomes[rows] == outcomes.REACHED]
        # The energies of ended chains are known, because the threads computed them.
        chains.find_energies(going)
        failed = self.arrays.status[rows] == FAILED
        return np.where(failed, np.nan, chains.energies[rows])

    def message(self, row: int) -> str:
        """Return a message about how a fold ended."""
        return self._messages[row]

    def held(self, row: int) -> NDArray[np.bool_]:
        """Return which components of a chain are held by friction, (n,), component 1 first."""
        held = self.engine.stuck[row] == 1
        return held[::-1] if self._flip[row] else held

    def motion(self) -> Trajectory | None:
        """Return the recording of a single chain so far; None if nothing is recorded."""
        found = self.engine.motion(Orientation(bool(self._flip[0]), self._length))
        return found.finite() if found else found

    def scene(self, row: int) -> Scene:
        """Return the scene drawn for a chain, with the magnets and speeds of fed components."""
        scene, speeds = self.drawn(row), self.engine.speeds[row]
        sequence, chosen = list(scene.sequence), scene.speeds
        for index in self.arrays.order(row)[: self.arrays.fed[row]]:
            sequence[index] = letters_of(self.arrays.signs[row, index])
            chosen[index] = speeds[scene.n - 1 - index if self._flip[row] else index]
        return scene.replace(sequence=sequence, feed={"speed": chosen})

    def drawn(self, row: int) -> Scene:
        """Return the scene drawn for a chain, with the sequence of its template."""
        again = cast("np.random.Generator", _Again(self._numbers[row]))
        return self.templates[int(self.engine.kind[row])].draw(again)

    def hidden(self) -> Floats:
        """Return the numbers at `hidden_places`, scaled to [−1, 1), (m, places)."""
        return 2.0 * self._numbers[:, self._hidden] - 1.0

    def drive_as(self, scene: Scene) -> None:
        """Set the factors of the feed speeds to those in a drawn scene."""
        self.factors[:] = scene.speeds / REFERENCE_SPEED

    def get_state(self) -> tuple[Any, ...]:
        """Return the complete state of the chains."""
        arrays = [array.copy() for array in self.arrays]
        drawn = self.engine.kind.copy(), self._numbers.copy()
        return arrays, list(self._messages), *drawn, self.engine.get_state()

    def set_state(self, state: tuple[Any, ...]) -> None:
        """Restore a state that `get_state` returned; the earlier motion is discarded."""
        arrays, messages, kinds, self._numbers[:], engine = state
        for kind in np.unique(kinds).tolist():
            self._put_in(np.flatnonzero(kinds == kind), kind)
        self.engine.set_state(engine)
        for array, values in zip(self.arrays, arrays, strict=True):
            array[:] = values
        self._flip[:] = self.arrays.forward
        self._messages = list(messages)

    def close(self) -> None:
        """Stop the threads, if there are any."""
        self.engine.queue.close()

    def _apply_draws(self, rows: Ints, kind: int) -> None:
        """Convert numbers drawn from [0, 1) to physical values."""
        scene, chains = self.templates[kind], self.engine
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
            chains.obstacles[rows, first:, ix.Y] = places
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

    def _offsets(self, rows: Ints, kind: int) -> Floats:
        """Return the initial offsets of hinges from the axis [m], (rows, n + 1), deepest first."""
        scene, n = self.templates[0], self.templates[0].n
        if self._given is not None:
            given = self._given[kind]
            return np.repeat(given[None], len(rows), axis=0)
        unit = 2.0 * self._numbers[rows, n + 3 : 2 * n + 4] - 1.0
        offsets = scene.start_offset_spread * unit + 0.0
        return np.ascontiguousarray(offsets[:, ::-1]) if self._flips[kind] else offsets

    def _sync_from_engine(self, rows: Ints) -> None:
        """Update the arrays from the engine, and mark chains whose simulations have ended."""
        chains, arrays = self.engine, self.arrays
        public_states(
            rows, self._flip, self._length, chains.counters, chains.q, chains.v, arrays.angles,
            arrays.rates, arrays.base, arrays.base_velocity,
        )  # fmt: skip
        _release(rows, chains.released, self.seen)
        for row in rows[chains.outcomes[rows] != outcomes.REACHED].tolist():
            status, self._messages[row] = ending(
                int(chains.outcomes[row]),
                float(chains.times[row]),
                np.diff(arrays.angles[row]).tolist(),
                work_cap(chains.models[0], int(chains.steps[row])),
            )
            arrays.status[row] = STATUSES.index(status)


class _Again:
    """A random source that returns earlier numbers again, so that `Scene.draw` repeats itself."""

    def __init__(self, numbers: Floats) -> None:
        self._left = numbers

    def random(self, size: int | tuple[int, ...]) -> Floats:
        """Return the next numbers."""
        count = int(np.prod(size))
        numbers, self._left = self._left[:count], self._left[count:]
        return numbers.reshape(size)


def hidden_places(scene: Scene) -> Ints:
    """Return which of the numbers that `Scene.draw` draws set the physics of an episode.

    The others have spreads of 0 or set the initial offsets of hinges.
    """
    n, spreads = scene.n, scene.spreads
    friction = max(spreads.friction, spreads.friction_decades)
    each, moves = int(spreads.one_by_one), int(spreads.moves_obstacles)
    widths = [
        *(friction, spreads.mass, spreads.remanence, spreads.feed_speed, 0.0, spreads.feed_jitter),
        *(spreads.magnet, spreads.obstacle_width, spreads.obstacle_offset, spreads.tilt),
    ]
    counts = [1, n, 1, 1, n + 1, n * each, 4 * n * each, moves, moves, 2]
    return np.flatnonzero(np.repeat(widths, counts))


def _nothing_drawn(template: Scene) -> Scene:
    """Return a concrete, straight form of a template, with a magnet behind every face."""
    spreads = dict.fromkeys(type(template.spreads).model_fields, 0.0)
    sequence = (PATTERNS[0],) * template.n
    straight = (0.0,) * (template.n - 1)
    return template.replace(spreads=spreads, start_angles=straight, sequence=sequence)


@kernel
def _choose(
    rows: Ints,
    signs: Floats,
    speeds: Floats,
    scaled: Floats,
    grades: Floats,
    arrays: ChainArrays,
    strengths: Floats,
    factors: Floats,
    charges: Floats,
    feed_speeds: Floats,
) -> None:
    """Set the magnets and the speed of the next component, in the arrays and in the engine."""
    n = factors.shape[1]
    for j in range(rows.size):
        k: int = rows[j]
        flip = arrays.forward[k]
        i = component(flip, arrays.fed[k], n)
        inside = n - 1 - i if flip else i
        for face in range(4):
            arrays.signs[k, i, face] = signs[j, 0, face]
        for face in range(4):
            other = _TURNED[face] if flip else face
            strength = strengths[k, i, other] * grades[j, other]
            charges[k, inside, face] = arrays.signs[k, i, other] * strength
        arrays.speeds[k, i] = scaled[j]
        feed_speeds[k, inside] = speeds[j] * factors[k, i]
        arrays.fed[k] += 1


@kernel
def _release(rows: Ints, counts: Ints, arrays: ChainArrays) -> None:
    """Update which components of the given chains are released."""
    n = arrays.angles.shape[1]
    for j in range(rows.size):
        k: int = rows[j]
        for place in range(n):
            arrays.released[k, component(arrays.forward[k], place, n)] = place < counts[k]
