"""One chain being folded, step by step: what `simulate` and the environments drive."""

from __future__ import annotations

from typing import Any

import numpy as np

from magfold_env.engine import outcomes
from magfold_env.engine.chain import feed
from magfold_env.engine.compile.by_pointer import code_of, reference, write_down
from magfold_env.engine.contact import boxes
from magfold_env.engine.magnets.chain import magnet_energy, potential_energy
from magfold_env.engine.state import EVALUATIONS, LO, STEPS, TIME, Array, Model, Record, State, Work
from magfold_env.engine.stepping import integrator, paper_scheme, runs
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.fold import Fold, FoldStatus
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word
from magfold_env.simulation import view
from magfold_env.simulation.endings import ending, work_cap
from magfold_env.simulation.frames import Frames, magnetic_energy
from magfold_env.simulation.orientation import Orientation
from magfold_env.simulation.pack import component_charges, pack, reversed_inside

_CODE: list[Any] = []  # where that of the integrator lies, once it is compiled


class Session:
    """A chain at the beginning of its run, or anywhere in it.

    Parameters
    ----------
    scene
        What to simulate; anything it leaves to chance must be drawn first (`Scene.draw`).
    frame_rate
        Frames recorded a simulated second [1/s]; None records nothing.

    Raises
    ------
    ValueError
        If the scene is not concrete, or too long for contact and friction.
    """

    def __init__(self, scene: Scene, frame_rate: float | None = None) -> None:
        if not scene.is_concrete:
            msg = "scene: leaves start angles or spreads to chance; draw it first (Scene.draw)"
            raise ValueError(msg)
        self._scene = scene
        self._model = pack(scene)
        self._view = Orientation(reversed_inside(scene), self._model.bodies.length)
        joints = np.asarray(scene.start_angles, dtype=np.float64)
        headings = self._view.start(joints, centred=scene.mount == "tube")
        self._state = new_state(self._model, headings)
        self._work = new_work(self._model)
        self._frames = Frames(self._model, self._state, frame_rate)
        self._faces = list(scene.sequence)
        self._speeds = scene.speeds.copy()
        self._status: FoldStatus | None = None
        self._message = ""
        if scene.contact and scene.mount != "tube":
            self._refuse_overlap()
        if scene.mount == "tube" and scene.feed.loading == "at_mouth":
            # A component's magnets act from when its leading hinge reaches the mouth.
            self._waiting = self._model.charge.copy()
            self._model.charge[:] = 0.0
        else:
            self._waiting = None
        write_down(self._model, self._state, self._work, self._frames.record)

    # --- what a caller may see -------------------------------------------------------------

    @property
    def n(self) -> int:
        """Number of components."""
        return self._model.n

    @property
    def released(self) -> int:
        """Components that are out of the tube and free; all n where there is no tube."""
        return self.n - int(self._state.counter[LO])

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._state.clock[TIME])

    @property
    def steps(self) -> int:
        """Time steps so far; one that was tried again counts once."""
        return int(self._state.counter[STEPS])

    @property
    def evaluations(self) -> int:
        """Evaluations of the accelerations so far."""
        return int(self._state.counter[EVALUATIONS])

    @property
    def status(self) -> FoldStatus | None:
        """How the run ended; None while it has not."""
        return self._status

    @property
    def message(self) -> str:
        """The status in words."""
        return self._message

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
        n, state = self.n, self._state
        seen = np.empty(n), np.empty(n), np.empty(2), np.empty(2)
        lo = int(state.counter[LO])
        view.look(self._view.flip, lo, self._view.length, state.q, state.v, *seen)
        return seen

    @property
    def word(self) -> str:
        """Nearest fold word; empty where numbers broke down."""
        joints = np.diff(self.angles)
        return angles_to_word(joints) if np.isfinite(joints).all() else ""

    def energy(self) -> float:
        """Magnetic energy of the components whose magnets act [J], an outer field's included."""
        return magnet_energy(self._place(), self._model, self._work)

    def potential(self) -> float:
        """Energy whose exact gradient the simulated magnet forces are [J].

        Within the magnets' accuracy it is `energy`, which sums where the dynamics looks up.
        """
        return potential_energy(self._place(), self._model, self._state.q, self._work)

    def _place(self) -> int:
        """Find the pose, and return the first component whose magnets act."""
        lo = int(self._state.counter[LO])
        return int(feed.place_all(lo, self._model, self._state.q, self._work.pose))

    # --- what a caller may do --------------------------------------------------------------

    def set_component(self, index: int, faces: str, speed: float) -> None:
        """Choose magnets and feed speed [m/s] of a component that is still in the tube.

        Parameters
        ----------
        index
            Component number minus one.
        faces
            Four letters, N, S or - for none: front-left, back-left, back-right, front-right.

        Raises
        ------
        ValueError
            If the component's magnets act already.
        """
        if self._waiting is None or not self._scene.magnets:
            msg = "feed.loading: magnets can be chosen only with a tube loaded 'at_mouth'"
            raise ValueError(msg)
        inside = self._view.index(index)
        if inside >= self._state.counter[LO]:
            msg = f"component {index + 1} has left the tube; {self.released} have"
            raise ValueError(msg)
        self._waiting[inside] = component_charges(faces, index, self._scene)
        self._faces[index] = faces
        self._speeds[index] = speed

    def feed_one(self) -> None:
        """Push the next component out until it is released."""
        state, model = self._state, self._model
        lo = int(state.counter[LO])
        if lo == 0:
            msg = "no component is left in the tube"
            raise ValueError(msg)
        if self._status is not None:
            return
        i = lo - 1
        if self._waiting is not None:
            model.charge[i] = self._waiting[i]
        speed = float(self._speeds[self._view.index(i)])
        feed.change_speed(model, state, self._work, speed)
        until = state.clock[TIME] + feed.time_to_release(model, state)
        if lo == model.n:
            # Nothing is outside yet that could move by itself.
            self._frames.take_straight(until)
            state.q[model.n] += speed * (until - state.clock[TIME])
            state.clock[TIME] = until
        elif not self._advance(until):
            return
        feed.release(model, state)

    def settle(self) -> None:
        """Integrate until the chain rests or the scene's duration is over."""
        if self._status is not None:
            return
        if self._advance(self._state.clock[TIME] + self._scene.duration):
            self._end(*self._ending(outcomes.TIMED_OUT))

    def fold(self) -> Fold:
        """Return the result of a run that has ended.

        Raises
        ------
        ValueError
            If it has not.
        """
        if self._status is None:
            msg = "the run has not ended; settle it first"
            raise ValueError(msg)
        return Fold(
            scene=self.scene(),
            status=self._status,
            message=self._message,
            word=self.word,
            angles=self.angles,
            base=self.base,
            energy=self.energy(),
            time=self.time,
            steps=self.steps,
            evaluations=self.evaluations,
            trajectory=self._frames.trajectory(self._view),
            magnetic_energy=magnetic_energy,
        )

    def scene(self) -> Scene:
        """Return the scene of this run, with the magnets and speeds that were chosen in it."""
        if self._waiting is None:
            return self._scene
        return self._scene.replace(
            sequence=tuple(self._faces), feed={"speed": tuple(self._speeds.tolist())}
        )

    # --- within ----------------------------------------------------------------------------

    def _advance(self, until: float) -> bool:
        """Integrate; returns whether the time was reached rather than an end."""
        chain = self._model, self._state, self._work, self._frames.record
        while True:
            if self._scene.solver.method == "paper":
                outcome = paper_scheme.paper_advance(*chain, until, self._scene.solver.time_step)
            else:
                outcome = _integrate(chain, until)
            if outcome != outcomes.FULL:
                break
            self._frames.empty()
        if outcome == outcomes.REACHED:
            return True
        self._end(*self._ending(outcome))
        return False

    def _ending(self, outcome: int) -> tuple[FoldStatus, str]:
        """Return how an integration ended, and the same in words."""
        rested = outcome == outcomes.RESTED
        joints: list[float] = np.diff(self.angles).tolist() if rested else []
        return ending(outcome, self.time, joints, work_cap(self._model, self.steps))

    def _refuse_overlap(self) -> None:
        model, work = self._model, self._work
        feed.place_all(0, model, self._state.q, work.pose)
        boxes.place_boxes(0, model, work.pose, work)
        pair = boxes.overlapping_pair(model, work)
        if pair[0] >= 0:
            first, second = sorted(self._view.index(k) + 1 for k in pair)
            self._end(FoldStatus.FAILED, f"components {first} and {second} overlap at the start")

    def _end(self, status: FoldStatus, message: str) -> None:
        self._status = status
        self._message = message


def _integrate(chain: tuple[Model, State, Work, Record], until: float) -> int:
    """Call the integrator by its address, which spares finding out what its arguments hold."""
    if not _CODE:
        _CODE.append(code_of(integrator.advance, *chain, until))
    model, state, work, record = (reference(each) for each in chain)
    return runs.advance_at(_CODE[0], model, state, work, record, until)
