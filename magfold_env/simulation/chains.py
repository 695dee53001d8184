"""Many chains, side by side in arrays, run by kernels on several threads."""

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from magfold_env.engine import indices as ix
from magfold_env.engine.chain.tube import lie_in_tube
from magfold_env.engine.compile.by_pointer import POINTERS, code_of, reference
from magfold_env.engine.outcomes import PAUSED, REACHED, TIMED_OUT
from magfold_env.engine.state import Array, IntArray, Model, State, Work
from magfold_env.engine.stepping import paper_scheme, runs
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.fold import Trajectory
from magfold_env.simulation.batched_arrays import BatchedArrays
from magfold_env.simulation.frames import Frames
from magfold_env.simulation.pack import Numbers
from magfold_env.simulation.view import Orientation
from magfold_env.simulation.work_queue import WorkQueue

OWN = ("charge", "friction_limit", "bodies.mass", "bodies.inertia", "obstacles")
"""Parts of a model that may differ between chains, besides the numbers that `Chains` names."""
AT_ONCE = 64  # chains per compiled call, each run for at most 50 ms
_FIRST = np.zeros(1, dtype=np.int64)
_CODES: dict[str, Any] = {}  # addresses of `runs.run` and `runs.energy`, once compiled


class Chains:
    """Chains that differ in their drawn values, with components in the engine's order.

    All arrays are shared with the kernels, which see everything that is written to them.

    Parameters
    ----------
    models
        The models: one for all chains, or several, such as one for each direction of feed, of which
        each chain gets one when it starts.
    count
        Number of chains.
    threads
        Number of threads that run the chains.
    frame_rate
        Frames recorded per simulated second [1/s], for a single chain; None records nothing.
    """

    def __init__(
        self,
        models: Sequence[Model],
        count: int,
        threads: int = 1,
        frame_rate: float | None = None,
    ) -> None:
        self.models = models
        self.queue = WorkQueue(threads)
        states = [new_state(model, np.zeros(model.n)) for model in models]
        works = [new_work(model) for model in models]
        self._models: BatchedArrays[Model] = BatchedArrays(models, count, OWN)
        self._states: BatchedArrays[State] = BatchedArrays(states, count)
        self._works: BatchedArrays[Work] = BatchedArrays(works, count)
        references = self._models.references, self._states.references, self._works.references
        self._references: tuple[Any, Any, Any] = references
        self._frame_rate = frame_rate if count == 1 else None
        self.state = self._states.row(0)
        """State of the first chain."""
        self.frames = Frames(models[0], self.state, self._frame_rate)
        """Record of a single chain."""
        self.paper_step: float | None = None
        """Time step of the paper's scheme [s], if a single chain uses it."""
        self.kind: IntArray = np.zeros(count, dtype=np.int64)
        """Index of the model of each chain."""
        self.mass, self.inertia = self._models["bodies.mass"], self._models["bodies.inertia"]
        self.friction_limit, self.charge = self._models["friction_limit"], self._models["charge"]
        self.obstacles: Array = self._models["obstacles"]
        self.typical_rate = self._models.number("typical_rate")
        self.fastest_rate = self._models.number("fastest_rate")
        self.gravity = [self._models.number(f"gravity_{axis}") for axis in "xy"]
        self.q, self.v, self.stuck = (self._states[name] for name in ("q", "v", "stuck"))
        self.counters: IntArray = self._states["counter"]
        self.clocks: Array = self._states["clock"]
        self.depths: Array = self._states["feed"][:, ix.DEPTH]
        """Initial lengths of the chains in the tube [m]."""
        self.impulses: Array = self._states["account"][:, ix.IMPULSE]
        """The drives' impulses so far [N·s]."""
        self.waiting: Array = self._states["waiting"]
        """Charges that components receive when they are fed [A·m]."""
        self.speeds: Array = self._states["speed"]
        """Speeds at which components are fed [m/s]."""
        self.outcomes: IntArray = np.zeros(count, dtype=np.int64)
        """Outcome of each integration; REACHED means that it has not ended."""
        self.energies: Array = np.zeros(count)
        """Magnetic energies [J] of chains whose runs have ended."""
        self._until: Array = np.full(count, math.inf)

    @property
    def model(self) -> Model:
        """The model of the first chain at its beginning."""
        return self._models.row(0, int(self.kind[0]))

    @cached_property
    def work(self) -> Work:
        """Scratch space of the first chain."""
        return self._works.row(0)

    @property
    def released(self) -> IntArray:
        """Number of components out of the tube, (count,)."""
        return self.models[0].n - self.counters[:, ix.N_HELD]

    @property
    def times(self) -> Array:
        """Simulated times [s], (count,)."""
        return self.clocks[:, ix.TIME]

    @property
    def steps(self) -> IntArray:
        """Time steps tried, (count,)."""
        return self.counters[:, ix.STEPS]

    def clear(self, rows: IntArray, kind: int = 0) -> None:
        """Set the model of some chains and put them into the tube; see `start`."""
        for arrays in (self._models, self._states, self._works):
            arrays.restore(rows, kind)
        self.kind[rows] = kind
        self.outcomes[rows] = REACHED

    def become(self, model: Model, headings: Array, frame_rate: float | None) -> None:
        """Replace a single chain by another of the same size, at rest with given headings [rad].

        It may have a tube or not; for a tube see `start`.
        """
        self.remodel(model)
        for mine, new in zip(self.state, new_state(model, headings), strict=True):
            mine[:] = new
        self._works.restore(_FIRST)
        self.outcomes[0], self._frame_rate = REACHED, frame_rate
        self.frames = Frames(model, self.state, frame_rate)

    def remodel(self, model: Model) -> None:
        """Change the model of a single chain during its run."""
        self.models = [model]
        self._models.become(model)

    def put(self, rows: IntArray, numbers: Numbers) -> None:
        """Set the drawn numbers of some cleared chains."""
        self.mass[rows], self.inertia[rows] = numbers.mass, numbers.inertia
        self.friction_limit[rows] = numbers.friction_limit
        self.typical_rate[rows], self.fastest_rate[rows] = (
            numbers.typical_rate,
            numbers.fastest_rate,
        )
        for gravity, along in zip(self.gravity, numbers.pull.T, strict=True):
            gravity[rows] = along

    def start(self, rows: IntArray, offsets: Array) -> None:
        """Start cleared chains at rest in tubes, with given offsets of hinges from the axis [m].

        Offsets (rows, n + 1) begin at the inner end. The chains' draws must already be in the
        arrays.
        """
        n = self.models[0].n
        headings, depth = np.empty((len(rows), n)), np.empty(len(rows))
        lie_in_tube(offsets, self.models[0].bodies.length, headings, depth)
        self._states["feed"][rows, ix.DEPTH] = depth
        self.q[rows, :n] = headings
        self.q[rows, n + 1] = offsets[:, n]
        self.clocks[rows, ix.STEP] = 0.1 / self.fastest_rate[rows]
        if self._frame_rate is not None:
            self.frames = Frames(self.models[0], self.state, self._frame_rate)

    def feed(self, rows: IntArray, *, whole: bool = False, until: float | Array = math.inf) -> None:
        """Feed the next component of some chains, or the ``whole`` rest; fully fed chains settle.

        The chains pause at the time ``until`` [s] if they have not finished.
        """
        left = self.counters[rows, ix.N_HELD] - 1
        self.counters[rows, ix.KEEP] = -1 if whole else np.where(left > 0, left, -1)
        self._until[rows] = until
        self._run(rows)

    def push(self, rows: IntArray, seconds: float | Array) -> None:
        """Feed some chains for a time [s] or for one time each; fully fed chains move freely."""
        self.counters[rows, ix.KEEP] = -1
        self._until[rows] = self.clocks[rows, ix.TIME] + seconds
        self._run(rows)

    def pull(self, rows: IntArray, forces: Array, seconds: float) -> None:
        """Apply forces [N], (rows, 2), to some chains while they move for a time [s].

        Each force is spread over the mass outside the tube, like gravity.
        """
        free = np.arange(self.models[0].n) >= self.counters[rows, ix.N_HELD][:, None]
        mass = np.where(free, self.mass[rows], 0.0).sum(axis=1)
        usual = [gravity[rows] for gravity in self.gravity]
        for gravity, force in zip(self.gravity, forces.T, strict=True):
            gravity[rows] += np.divide(force, mass, out=np.zeros(len(rows)), where=mass > 0.0)
        # Values from the end of the last step are no longer valid.
        self.counters[rows, ix.FRESH] = 1
        self.push(rows, seconds)
        for gravity, before in zip(self.gravity, usual, strict=True):
            gravity[rows] = before
        self.counters[rows, ix.FRESH] = 1

    def find_energies(self, rows: IntArray) -> None:
        """Fill in `energies` for the present states of some chains."""
        runs.energies_of(self._codes, *self._references, rows, self.energies)

    def energy(self, row: int) -> float:
        """Return the magnetic energy [J] of a chain in its present state."""
        model, state, work = (each[row] for each in self._references)
        return float(runs.energy_at(self._code("energy"), model, state, work, 0.0))

    def run(self, row: int, until: float, progress: Callable[[], object] | None = None) -> int:
        """Run a chain until a time [s] or the end that its state sets; call ``progress`` each turn.

        Returns the outcome.
        """
        while (outcome := self.turn(row, until)) == PAUSED:
            if self.frames.record.interval > 0.0:
                self.frames.empty()
            if progress is not None:
                progress()
        return outcome

    def turn(self, row: int, until: float) -> int:
        """Run a chain like `run`, but for at most about 50 ms of computing time."""
        record = self.frames.record
        if self.paper_step is not None:
            chain, end = (self.model, self.state, self.work, record), float(self.clocks[0, ix.END])
            outcome = paper_scheme.paper_advance(*chain, min(until, end), self.paper_step)
            return TIMED_OUT if outcome == REACHED and end <= until else outcome
        model, state, work = (each[row] for each in self._references)
        code = self._code("run", record)
        return int(runs.run_at(code, model, state, work, reference(record), until))

    def motion(self, view: Orientation) -> Trajectory | None:
        """Return the frames of a single chain, or None if nothing is recorded."""
        return self.frames.trajectory(view)

    def get_state(self) -> tuple[Any, ...]:
        """Return the complete state of the chains, except for their draws."""
        batched = (self._models, self._states, self._works)
        blocks = (arrays.get_state() for arrays in batched)
        return (*blocks, self.outcomes.copy(), self.energies.copy())

    def set_state(self, state: tuple[Any, ...]) -> None:
        """Restore a state that `get_state` returned; set the draws first.

        A recording that continues from here has no earlier frames.
        """
        *blocks, self.outcomes[:], self.energies[:] = state
        for arrays, block in zip((self._models, self._states, self._works), blocks, strict=True):
            arrays.set_state(block)
        if self._frame_rate is not None:
            self.counters[:, ix.FRAMES] = 0
            self.frames = Frames(self.models[0], self.state, None)

    def _code(self, name: str, *last: Any) -> Any:
        if name not in _CODES:
            chain = self.models[0], self.state, self.work, *last
            _CODES[name] = code_of(getattr(runs, name), *chain, 0.0)
        return _CODES[name]

    @cached_property
    def _codes(self) -> Any:
        codes = [self._code("run", self.frames.record), self._code("energy")]
        return np.array(codes, dtype=np.int64 if POINTERS else object)

    def _run(self, rows: IntArray) -> None:
        """Run chains until they end, or pause according to their states."""
        if len(rows) == 1:
            row = int(rows[0])
            self.outcomes[row] = self.run(row, float(self._until[row]))
            if self.outcomes[row] != REACHED:
                self.energies[row] = self.energy(row)
            return
        record = reference(self.frames.record)
        while len(rows) > 0:
            # Chains run in batches, because Python can be interrupted only between two calls.
            some, rows = rows[:AT_ONCE], rows[AT_ONCE:]
            arguments = (
                self._codes, *self._references, record, self._until, some, self.outcomes,
                self.energies, np.zeros(1, dtype=np.int64),
            )  # fmt: skip
            self.queue.run(runs.run_chains, arguments, len(some))
            paused = some[self.outcomes[some] == PAUSED]
            if len(paused) > 0:
                rows = np.concatenate([paused, rows])
