"""One chain that folds step by step, driven by `simulate` and the environments."""

import math
import weakref
from collections import deque
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.chain import feed, tube
from magfold_env.engine.contact import boxes
from magfold_env.engine.state import Array, Model
from magfold_env.fold import Fold, FoldStatus
from magfold_env.scene import Scene, Schedule
from magfold_env.scene.base import SPEED
from magfold_env.scene.errors import Problem, SceneError
from magfold_env.shapes import angles_to_word, headings
from magfold_env.simulation import view
from magfold_env.simulation.chains import Chains
from magfold_env.simulation.endings import ending, obstacle_names, work_cap
from magfold_env.simulation.frames import magnetic_energy
from magfold_env.simulation.pack import inner_offsets, pack, reversed_inside

Progress = Callable[[float, int], object]

ARRIVED = 1e-9  # [diagonals] tolerance for a feed's destination

_ROW = np.zeros(1, dtype=np.int64)
_SPARES = 8  # for chains of one kind; a fold takes less time than allocating its memory


@lru_cache(maxsize=16)
def _spare(*_sizes: int) -> deque[Chains]:
    return deque(maxlen=_SPARES)


def _spare_of(model: Model) -> deque[Chains]:
    """Return reusable chains of earlier runs whose arrays have the sizes that a model needs."""
    magnets = model.magnets
    nodes = magnets.node_x.shape if model.magnetic else ()
    lanes = magnets.level_node.shape[1] if model.magnetic else 0
    boxes = model.n + len(model.obstacles)
    return _spare(model.n, boxes, int(model.contact or model.frictional), lanes, *nodes)


class Account(NamedTuple):
    """The work of the drive and of other causes on a chain, and the energy lost in impacts.

    The kinetic and the magnetic energy together grow by all this work, less the losses in impacts
    and friction.
    """

    impulse: float
    """Impulse of the drive along the tube [N s]."""
    feed: float
    """Work of the drive [J]."""
    bumps: float
    """Work of bumps [J]."""
    loading: float
    """Work of adding and removing magnets at the mouth [J]."""
    impacts: float
    """Energy lost in impacts [J]."""
    push_peak: float
    """Peak of the drive's force [N]; see `Fold.push_peak`."""


class Session:
    """A chain at any point of its run: row 0 of `Chains` with one chain.

    Parameters
    ----------
    scene
        The scene to simulate; its random values must be drawn first (`Scene.draw`).
    frame_rate
        Frames recorded per simulated second [1/s], up to a million; None records nothing.

    Raises
    ------
    ValueError
        If the scene is not concrete, or too long for contact and friction.
    SceneError
        If the frame rate is not allowed.
    """

    def __init__(self, scene: Scene, frame_rate: float | None = None) -> None:
        if not scene.is_concrete:
            raise ValueError(
                "scene: leaves start angles or spreads to chance; draw it first (Scene.draw)"
            )
        self.scene = scene
        """The simulated scene."""
        self.status: FoldStatus | None = None
        """Status of the run; None until it has ended."""
        self.message = ""
        """A message that explains the status."""
        self.progress: Progress = lambda _time, _released: None
        """Called as in `simulate`; `settle` and other methods can continue a run that it stops."""
        model = pack(scene)
        self._view = view.Orientation(reversed_inside(scene), model.bodies.length)
        spare = _spare_of(model)
        try:
            chains = spare.pop()
        except IndexError:  # or another thread has taken it
            chains = Chains([model], 1)
        weakref.finalize(self, spare.append, chains).atexit = False
        if scene.mount == "tube":
            chains.become(model, np.zeros(scene.n), frame_rate)
            chains.start(_ROW, inner_offsets(scene)[None])
        else:
            chains.become(model, headings(scene.start_angles or ()), frame_rate)
        paper = scene.solver.method == "paper"
        chains.paper_step = scene.solver.time_step if paper else None
        self._chains, self._state, self._work = chains, chains.state, chains.work
        self._ask(scene.speeds)
        if scene.contact and scene.mount != "tube":
            self._refuse_overlap()
        if scene.mount == "tube" and scene.feed.loading == "at_mouth":
            # A component's magnets act once its leading hinge reaches the mouth.
            chains.charge[:] = 0.0

    # --- state for callers -----------------------------------------------------------------

    @property
    def n(self) -> int:
        """Number of components."""
        return self.scene.n

    @property
    def released(self) -> int:
        """Number of components out of the tube and free; n without a tube."""
        return self.n - self._held

    @property
    def _held(self) -> int:
        return int(self._state.counter[ix.N_HELD])

    @property
    def advance(self) -> float:
        """Advance of the feed [m], at least 0; it is meaningless once all components are out."""
        return float(tube.advance(self._model, self._state))

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._state.clock[ix.TIME])

    @property
    def steps(self) -> int:
        """Number of time steps so far; a repeated step counts once."""
        return int(self._state.counter[ix.STEPS])

    @property
    def evaluations(self) -> int:
        """Number of evaluations of the accelerations so far."""
        return int(self._state.counter[ix.EVALUATIONS])

    @property
    def angles(self) -> Array:
        """Headings [rad], component 1 first, shape (n,)."""
        return self._view.headings(self._state.q[: self.n])

    @property
    def rates(self) -> Array:
        """Rates of the headings [rad/s], shape (n,)."""
        return self._view.rates(self._state.v[: self.n])

    @property
    def base(self) -> Array:
        """Outer hinge of component 1 [m], shape (2,)."""
        return self._seen()[2]

    @property
    def base_velocity(self) -> Array:
        """Velocity of component 1's outer hinge [m/s], shape (2,)."""
        return self._seen()[3]

    def _seen(self) -> tuple[Array, Array, Array, Array]:
        """Return headings, rates, outer hinge and its velocity."""
        seen = np.empty(self.n), np.empty(self.n), np.empty(2), np.empty(2)
        moving = self._state.q, self._state.v
        view.public_state(self._view.flip, self._held, self._view.length, *moving, *seen)
        return seen

    @property
    def word(self) -> str:
        """Nearest fold word; empty if the simulation failed."""
        joints = np.diff(self.angles)
        return angles_to_word(joints) if np.isfinite(joints).all() else ""

    def energy(self) -> float:
        """Magnetic energy of the components whose magnets act [J], including an external field."""
        return self._chains.energy(0)

    def potential(self) -> float:
        """Return the energy whose exact gradient gives the simulated magnet forces [J].

        It equals `energy` to within the accuracy of the magnets: `energy` uses sums, and the
        dynamics uses tables.
        """
        return float(feed.potential_of(self._model, self._state, self._work))

    @cached_property
    def _model(self) -> Model:
        return self._chains.model

    # --- actions of callers ---------------------------------------------------------------

    def feed_one(self) -> None:
        """Push the next component out until it is released, regardless of the schedule.

        Raises
        ------
        ValueError
            If no component is left in the tube.
        """
        if self._held == 0:
            raise ValueError("no component is left in the tube")
        self._go_on(keep=self._held - 1)

    def settle(self) -> None:
        """Feed the remaining components, and integrate until the chain rests or its time is over.

        If the scene has a schedule, the feed follows it from its first leg and then stops. After a
        `push`, the feed keeps its last speed. A feed that has stopped, or has drawn in as much as
        it can, does not move again: the components outside have the scene's ``duration`` to settle,
        and the status is then ``held``.
        """
        schedule = self.scene.feed.schedule if self.scene.mount == "tube" else None
        if schedule is not None:
            self._follow(schedule)
            if self._held > 0:
                self._ask(np.zeros(self.n))
        self._go_on(keep=-1)

    def push(self, speeds: Array | float, seconds: float) -> None:
        """Feed for a time [s] or until the run ends.

        ``speeds`` is the speed of the feed [m/s], or (n,) speeds while each component is in the
        mouth, component 1 first; negative speeds pull back. A component that passes the mouth is
        released, and may be held again when it is drawn in. Once no component is left inside, the
        chain folds freely.

        Raises
        ------
        SceneError
            If a speed is not a finite number, or is faster than any drive.
        """
        every = np.broadcast_to(np.asarray(speeds, dtype=np.float64), self.n)
        if not (np.abs(every) <= SPEED.most).all():
            allowed = f"must be numbers from -{SPEED.most:g} to {SPEED.most:g} m/s"
            raise SceneError([Problem("speeds", speeds, allowed)])
        self._ask(every)
        self._go_on(keep=-1, until=self.time + seconds)

    def _ask(self, speeds: Array) -> None:
        """Set the feed's speeds; each applies while its component is in the mouth."""
        self._state.speed[:] = speeds[::-1] if self._view.flip else speeds

    def _follow(self, schedule: Schedule) -> None:
        """Feed according to a schedule while components are left in the tube."""
        for seconds, speed in schedule.time or ():
            self._go(speed, seconds)
        diagonal = self.scene.casing.diagonal
        for goal, speed in schedule.advance or ():
            # A drive that slips arrives later.
            while self.status is None and self._held > 0:
                way = goal * diagonal - self.advance
                if abs(way) <= ARRIVED * diagonal:
                    break
                self._go(math.copysign(speed, way), abs(way) / speed)

    def _go(self, speed: float, seconds: float) -> None:
        """Feed for a time, or until all components are out."""
        if self._held > 0:
            self._ask(np.full(self.n, speed))
            self._go_on(keep=0, until=self.time + seconds)

    @property
    def account(self) -> Account:
        """The work on the chain and its losses so far."""
        return Account(*self._state.account[: ix.BEFORE].tolist())

    def fold(self) -> Fold:
        """Return the result of a run that has ended.

        Raises
        ------
        ValueError
            If the run has not ended.
        """
        if self.status is None:
            raise ValueError("the run has not ended; settle it first")
        return Fold(
            scene=self.scene,
            status=self.status,
            message=self.message,
            word=self.word,
            angles=self.angles,
            base=self.base,
            energy=self.energy(),
            time=self.time,
            steps=self.steps,
            evaluations=self.evaluations,
            push_peak=self.account.push_peak,
            in_tube=self._held,
            trajectory=self._chains.frames.trajectory(self._view, ended=True),
            magnetic_energy=magnetic_energy,
        )

    # --- internals -------------------------------------------------------------------------

    def _go_on(self, keep: int, until: float = math.inf) -> None:
        """Run until the given number of components is held (see `State`) or until a time [s]."""
        if self.status is not None:
            return
        self._state.counter[ix.KEEP] = keep
        outcome = self._run(until)
        if outcome != outcomes.REACHED:
            rested = outcome == outcomes.RESTED
            joints: list[float] = np.diff(self.angles).tolist() if rested else []
            cap = work_cap(self._chains.models[0], self.steps)
            self.status, self.message = ending(outcome, self.time, joints, cap, self._held)
            if self.status is FoldStatus.JAMMED and (pressed := self._what_presses()):
                self.message += f"; {pressed}"

    def _what_presses(self) -> str:
        """Return a text that names the contacts of a jammed chain."""
        rows, n, index = self._work.rows, self.n, self._view.index
        stops, contacts = rows.counts[ix.JOINT_STOPS], rows.counts[ix.CONTACTS]
        names = obstacle_names(self.scene)
        found: list[str] = []
        for r in np.flatnonzero(rows.multiplier[:contacts] > 0.0).tolist():
            one, other = sorted(rows.id[r, :2].tolist())
            if r < stops:
                # Joint k of the engine is before its component k, and behind it in public order.
                joint = index(int(rows.id[r, 0])) + (1 if self._view.flip else 0)
                found.append(f"joint {joint} is at its stop")
            elif other < n:
                first, second = sorted((index(one) + 1, index(other) + 1))
                found.append(f"component {first} touches component {second}")
            else:
                found.append(f"component {index(one) + 1} touches {names[other - n]}")
        return ", ".join(dict.fromkeys(found))

    def _run(self, until: float) -> int:
        """Run until a time [s] or an end; return the outcome of the integration."""
        return self._chains.run(0, until, lambda: self.progress(self.time, self.released))

    def _refuse_overlap(self) -> None:
        model, work = self._chains.models[0], self._work
        headings: Array = self._state.q[: model.n]
        if headings.max() - headings.min() < 0.5 * math.pi and len(model.obstacles) == 0:
            # Along the line midway between the headings, each square is between its hinges.
            return
        tube.place_all(0, model, self._state.q, work.pose)
        boxes.place_boxes(0, model, work.pose, work)
        i, j = boxes.first_overlap(model, work)
        if i < 0:
            return
        numbers = sorted(self._view.index(k) + 1 for k in (i, j) if k < model.n)
        who = "components {} and {}" if j < model.n else "component {} and an obstacle"
        self.status = FoldStatus.FAILED
        self.message = f"{who.format(*numbers)} overlap at the start"
