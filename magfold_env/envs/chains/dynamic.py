"""Simulated chains, side by side, for environments."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from magfold_env.envs.chains.draws import DrawnChains
from magfold_env.envs.spaces.actions import SIGNS, letters_of
from magfold_env.fold import Trajectory
from magfold_env.scene import Scene
from magfold_env.simulation.endings import ending, work_cap
from magfold_env.simulation.pack import TURNED
from magfold_env.simulation.view import Orientation, advances, public_states

_TURNED = tuple(TURNED)
_AS_DRAWN = np.ones(4)
_ROUNDING = 1e-9  # [s] tolerance for the time at which a chain stops


class DynamicChains:
    """Simulated chains; see `magfold_env.envs.chains.quasistatic.QuasistaticChains`.

    Parameters
    ----------
    drawn : DrawnChains
        The drawn chains.
    """

    def __init__(self, drawn: DrawnChains) -> None:
        self.drawn, self._chains = drawn, drawn.chains
        count, n = drawn.factors.shape
        self._length = self._chains.models[0].bodies.length
        self._flip: Bools = np.zeros(count, dtype=np.bool_)
        self._messages = [""] * count
        self.arrays = ChainArrays.empty(count, n)
        self.seen = pointer(self.arrays)
        """`arrays` in the form that kernels accept fastest."""

    def begin(self, rows: Ints, rngs: Sequence[np.random.Generator], kind: int = 0) -> None:
        """Put chains into their tubes; everything random is drawn here, row k from ``rngs[k]``."""
        self.drawn.draw(rows, rngs, kind)
        self._flip[rows] = flip = bool(self.drawn.flips[kind])
        clear(rows, flip, self.seen)
        self._sync_from_engine(rows)

    def feed(
        self,
        rows: Ints,
        patterns: Ints,
        speeds: Floats,
        scaled: Floats,
        grades: Floats = _AS_DRAWN,
        until: float | Floats = math.inf,
    ) -> None:
        """Feed the next component of each chain, or all components; a complete chain settles.

        Parameters
        ----------
        patterns : array of int, shape (rows, components)
            Numbers of the patterns of one component or of all, component 1 first.
        speeds, scaled : array, shape (rows,)
            Feed speeds [m/s], and the same on the log scale from −1 to 1.
        grades : array, shape (rows, 4), optional
            Factors of the strengths of the next components' magnets.
        until : float or array, shape (rows,)
            Time at which the feeds pause [s] if they have not finished.
        """
        drawn, chains = self.drawn, self._chains
        signs, whole = SIGNS.take(patterns, axis=0), patterns.shape[1] > 1
        if whole:
            self.load(rows, signs)
            self.arrays.speeds[rows] = scaled[:, None]
            self._set_speeds(rows, speeds)
        else:
            _choose(
                rows, signs, speeds, scaled, np.broadcast_to(grades, (len(rows), 4)), self.seen,
                drawn.strengths, drawn.factors, chains.waiting, chains.speeds,
            )  # fmt: skip
        until = np.broadcast_to(until, len(rows))
        again = chains.released[rows] >= self.arrays.fed[rows]
        if again.any():  # was drawn back, and is not held
            self._move(rows[again], speeds[again], -0.5 * _ROUNDING, until[again])
        chains.feed(rows[~again], whole=whole, until=until[~again])
        self._sync_from_engine(rows)

    def load(self, rows: Ints, signs: Floats) -> None:
        """Set the magnets of whole chains, fed in one direction: outward poles (rows, n, 4)."""
        self.arrays.signs[rows] = signs
        self.arrays.fed[rows] = signs.shape[1]
        charges = signs * self.drawn.strengths[rows]
        if self._flip[rows[0]]:
            charges = charges[:, ::-1, TURNED]
        self._chains.waiting[rows] = charges
        if self.drawn.built:
            self._chains.charge[rows] = charges

    def push(self, rows: Ints, speeds: Floats, seconds: float) -> Floats:
        """Feed chains at given speeds [m/s], negative to pull back, for a time [s].

        Returns
        -------
        array, shape (rows,)
            The mean force of the drive over that time [N].
        """
        chains = self._chains
        self._set_speeds(rows, speeds)
        before = chains.impulses[rows]
        chains.push(rows, seconds)
        self._sync_from_engine(rows)
        force = (chains.impulses[rows] - before) / seconds
        return np.where(self.arrays.status[rows] == FAILED, 0.0, force)

    def pull(self, rows: Ints, forces: Floats, seconds: float) -> None:
        """Apply forces [N], (rows, 2), to the part of chains outside the tubes for a time [s].

        The feeds do not move.
        """
        chosen = self._chains.speeds[rows]
        self._set_speeds(rows, np.zeros(len(rows)))
        self._chains.pull(rows, forces, seconds)
        self._chains.speeds[rows] = chosen
        self._sync_from_engine(rows)

    def draw_back(self, rows: Ints, speeds: Floats, until: float) -> None:
        """Draw the last component that is out back into the tube, at speeds [m/s].

        It then has no magnets and may be chosen again, whether or not the tube holds it. Chains may
        end earlier, or reach the time ``until`` [s].
        """
        arrays, chains, n = self.arrays, self._chains, self.arrays.angles.shape[1]
        arrays.fed[rows] -= 1
        fed = arrays.fed[rows]
        last = np.where(arrays.forward[rows], fed, n - 1 - fed)
        arrays.signs[rows, last] = 0.0
        arrays.speeds[rows, last] = 0.0
        chains.waiting[rows, n - 1 - arrays.fed[rows]] = 0.0
        self._move(rows, -speeds, _ROUNDING, np.full(len(rows), until))
        self._sync_from_engine(rows)

    def _set_speeds(self, rows: Ints, speeds: Floats) -> None:
        """Choose a feed speed [m/s] for each of some chains, (rows,)."""
        factors = speeds[:, None] * self.drawn.factors[rows]
        flips = self._flip[rows][:, None]
        self._chains.speeds[rows] = np.where(flips, factors[:, ::-1], factors)

    def _move(self, rows: Ints, speeds: Floats, excess: float, until: Floats) -> None:
        """Feed chains until all chosen components are out, then for a further time [s].

        Feeding stops where the next component reaches the mouth, or at the time ``until`` [s].
        """
        chains, n, pitch, left = self._chains, self.arrays.angles.shape[1], self._length[0], rows
        chosen = chains.speeds[rows]
        self._set_speeds(rows, speeds)
        while len(left):
            inside = chains.released[left] - self.arrays.fed[left]  # but released earlier
            way = -inside * pitch - chains.q[left, n]
            seconds = way / chains.speeds[left, n - 1 - chains.released[left]] + excess
            on = seconds > 0.1 * _ROUNDING
            left, until = left[on], until[on]
            chains.push(left, np.minimum(seconds[on], until - chains.times[left]))
            going = (chains.outcomes[left] == outcomes.REACHED) & (chains.times[left] < until)
            left, until = left[going], until[going]
        chains.speeds[rows] = chosen

    def times(self, rows: Ints) -> Floats:
        """Return simulated times [s], (rows,)."""
        return self._chains.times[rows]

    def impulses(self, rows: Ints) -> Floats:
        """Return the impulses of the drives so far [N·s], (rows,)."""
        return self._chains.impulses[rows]

    def advances(self) -> Floats:
        """Return the advance of the feeds [m], (m,): the length of the chain if it is out."""
        chains, out = self._chains, np.empty(self._flip.size)
        advances(self._length, chains.counters, chains.q, chains.depths, out)
        return out

    def acting(self, row: int) -> int:
        """Return the number of components of a chain whose magnets act now."""
        return int(self._chains.charge[row].any(axis=1).sum())

    def stop(self, rows: Ints, message: str, status: int = UNSETTLED) -> None:
        """End some chains in their present state, by default with the status unsettled."""
        self.arrays.status[rows] = status
        for row in rows.tolist():
            self._messages[row] = message

    def energies(self, rows: Ints) -> Floats:
        """Return the magnetic energies [J]; NaN where a simulation failed."""
        chains, going = self._chains, rows[self._chains.outcomes[rows] == outcomes.REACHED]
        # Energies of ended chains are known: all threads computed them.
        chains.find_energies(going)
        failed = self.arrays.status[rows] == FAILED
        return np.where(failed, np.nan, chains.energies[rows])

    def message(self, row: int) -> str:
        """Return a message about how a fold ended."""
        return self._messages[row]

    def held(self, row: int) -> NDArray[np.bool_]:
        """Return which components of a chain friction holds in place, (n,), component 1 first."""
        held = self._chains.stuck[row] == 1
        return held[::-1] if self._flip[row] else held

    def motion(self) -> Trajectory | None:
        """Return the recording of a single chain so far; None if nothing is recorded."""
        found = self._chains.motion(Orientation(bool(self._flip[0]), self._length))
        return found.finite() if found else found

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain with the magnets and speeds of the fed components."""
        scene, speeds = self.drawn.scene(row), self._chains.speeds[row]
        sequence, chosen = list(scene.sequence), scene.speeds
        for index in self.arrays.order(row)[: self.arrays.fed[row]]:
            sequence[index] = letters_of(self.arrays.signs[row, index])
            chosen[index] = speeds[scene.n - 1 - index if self._flip[row] else index]
        return scene.replace(sequence=sequence, feed={"speed": chosen})

    def contents(self) -> tuple[Any, ...]:
        """Return the complete state of the chains."""
        arrays = [array.copy() for array in self.arrays]
        return arrays, list(self._messages), self.drawn.contents()

    def refill(self, contents: tuple[Any, ...]) -> None:
        """Restore a state that `contents` returned; the earlier motion is discarded."""
        arrays, messages, drawn = contents
        self.drawn.refill(drawn)
        for array, values in zip(self.arrays, arrays, strict=True):
            array[:] = values
        self._flip[:] = self.arrays.forward
        self._messages = list(messages)

    def close(self) -> None:
        """End the threads, if there are any."""
        self._chains.queue.close()

    def _sync_from_engine(self, rows: Ints) -> None:
        """Update the arrays from the engine, and mark chains that have ended."""
        chains, arrays = self._chains, self.arrays
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
    """Update the number of released components of some chains."""
    n = arrays.angles.shape[1]
    for j in range(rows.size):
        k: int = rows[j]
        for place in range(n):
            arrays.released[k, component(arrays.forward[k], place, n)] = place < counts[k]
