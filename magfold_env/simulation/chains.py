"""Many chains of one kind in their tubes, fed by one compiled call."""

from __future__ import annotations

from typing import Any

import numpy as np

from magfold_env.engine.compile.by_pointer import POINTERS, code_of, reference
from magfold_env.engine.outcomes import REACHED
from magfold_env.engine.state import (
    EVALUATIONS,
    LO,
    STEP,
    STEPS,
    TIME,
    Array,
    IntArray,
    Model,
    Record,
    State,
    Work,
)
from magfold_env.engine.stepping import integrator, runs
from magfold_env.engine.workspace import new_record, new_state, new_work
from magfold_env.simulation.stack import Stack
from magfold_env.simulation.view import look_at
from magfold_env.simulation.work_queue import Team

OWN = ("charge", "grip", "bodies.mass", "bodies.inertia")
"""What may differ from chain to chain in a model, besides the numbers that `Chains` names."""


class Chains:
    """Chains that differ in what is drawn for them, in the engine's order of components.

    All views are shared with the kernels: what is written into one is what they see.

    Parameters
    ----------
    model
        What they have in common, with a tube.
    count
        How many.
    threads
        How many threads feed them.
    """

    def __init__(self, model: Model, count: int, threads: int = 1) -> None:
        self.model = model
        self.count = count
        self.team = Team(threads)
        state, work = new_state(model, np.zeros(model.n)), new_work(model)
        self._models: Stack[Model] = Stack(model, count, OWN)
        self._states: Stack[State] = Stack(state, count)
        self._works: Stack[Work] = Stack(work, count)
        self._record: Any = new_record(model, 0.0, 0)
        self._code = _code(model, state, work, self._record)
        self.mass, self.inertia = self._models["bodies.mass"], self._models["bodies.inertia"]
        self.grip, self.charge = self._models["grip"], self._models["charge"]
        self.rate_scale = self._models.number("rate_scale")
        self.light_rate = self._models.number("light_rate")
        self.q, self.v, self.stuck = (self._states[name] for name in ("q", "v", "stuck"))
        self._counters: IntArray = self._states["counter"]
        self._clocks: Array = self._states["clock"]
        self.waiting: Array = np.zeros((count, model.n, 4))
        """Charges that components get when they are fed [A·m]."""
        self.speeds: Array = np.zeros((count, model.n))
        """Speeds at which they are fed [m/s]."""
        self.outcomes: IntArray = np.zeros(count, dtype=np.int64)
        """How each integration ended; REACHED: it has not."""
        self.energies: Array = np.zeros(count)
        """Magnetic energies [J] of chains that have ended."""

    @property
    def released(self) -> IntArray:
        """Components that are out of the tube, (count,)."""
        return self.model.n - self._counters[:, LO]

    @property
    def times(self) -> Array:
        """Simulated times [s], (count,)."""
        return self._clocks[:, TIME]

    @property
    def steps(self) -> IntArray:
        """Time steps tried, (count,)."""
        return self._counters[:, STEPS]

    @property
    def evaluations(self) -> IntArray:
        """Evaluations of the accelerations, (count,)."""
        return self._counters[:, EVALUATIONS]

    def restart(self, rows: IntArray, headings: Array) -> None:
        """Put some chains back into the tube, at rest with these headings (rows, n) [rad].

        What is drawn for them must be written into the views before.
        """
        self._states.restore(rows)
        self._works.restore(rows)
        self.q[rows, : self.model.n] = headings
        self._clocks[rows, STEP] = 0.1 / self.light_rate[rows]
        self.outcomes[rows] = REACHED

    def feed(self, rows: IntArray, duration: float, *, all_of_it: bool = False) -> None:
        """Feed out the next component of some chains, or all; chains that are all out settle.

        Parameters
        ----------
        duration
            Longest time to settle [s].
        """
        next_row = np.zeros(1, dtype=np.int64)
        arguments = self._batch(), rows, duration, all_of_it, next_row
        self.team.run(runs.feed_chains, arguments, len(rows))

    def find_energies(self, rows: IntArray) -> None:
        """Fill `energies` in for some chains as they are."""
        runs.find_energies(self._batch(), rows)

    def _batch(self) -> runs.Batch:
        """Return all chains as kernels see them."""
        return runs.Batch(
            self._code, self._models.references, self._states.references, self._works.references,
            reference(self._record), self._counters, self._clocks, self.charge, self.waiting,
            self.speeds, self.outcomes, self.energies,
        )  # fmt: skip

    def look(
        self, rows: IntArray, flip: bool, angles: Array, rates: Array, base: Array, velocity: Array
    ) -> None:
        """See `magfold_env.simulation.view.look_at`."""
        length = self.model.bodies.length
        look_at(
            rows, flip, length, self._counters, self.q, self.v, angles, rates, base, velocity
        )  # fmt: skip


def _code(model: Model, state: State, work: Work, record: Record) -> IntArray:
    """Return the addresses of the code for BEGIN, ADVANCE, RELEASE and ENERGY."""
    chain = model, state, work
    return np.array(
        [
            code_of(runs.begin, *chain, 0.0),
            code_of(integrator.advance, *chain, record, 0.0),
            code_of(runs.end, *chain, 0.0),
            code_of(runs.energy, *chain, 0.0),
        ],
        dtype=np.int64 if POINTERS else object,
    )
