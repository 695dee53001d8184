"""The frames of one run, and the magnetic energies of recorded motions.

The kernels write frames to a buffer, which is emptied when it is full.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated
from magfold_env.engine.magnets import outer_field, pairs
from magfold_env.engine.state import Array, Model, Record, State
from magfold_env.engine.stepping.integrator import LONGEST_STEP
from magfold_env.engine.workspace import new_record, new_work
from magfold_env.fold import Trajectory, loaded
from magfold_env.scene import Scene, errors
from magfold_env.simulation.pack import pack
from magfold_env.simulation.view import Orientation

ROOM = 4096  # frames kept before they are moved out of the kernels' record
FASTEST = 1e6  # frames per second [1/s]
APART = 1e-9  # [s] nearer frames count as the same moment


class Frames:
    """The frames of a chain so far, at a given rate [1/s]; none if the rate is None."""

    def __init__(self, model: Model, state: State, frame_rate: float | None) -> None:
        if frame_rate is not None:
            errors.refuse(errors.unless_positive("frame_rate", frame_rate, FASTEST))
        interval = 0.0 if frame_rate is None else 1.0 / frame_rate
        capacity = ROOM + int(LONGEST_STEP / interval) if interval else 0
        self._model, self._state = model, state
        self._parts: list[list[npt.NDArray[Any]]] = []
        self.record: Record = new_record(model, interval, capacity)
        """Buffer to which the kernels write frames."""

    def empty(self) -> None:
        """Empty the buffer of the kernels."""
        count, record = int(self._state.counter[ix.FRAMES]), self.record
        columns = record.time, record.q, record.v, record.lo, record.impulse
        self._parts.append([column[:count].copy() for column in columns])
        self._state.counter[ix.FRAMES] = 0

    def trajectory(self, view: Orientation, *, ended: bool = False) -> Trajectory | None:
        """Return all frames in public form, or None if nothing is recorded.

        If the run has ``ended``, the last frame shows its end, whatever the time.
        """
        interval = self.record.interval
        if interval == 0.0:
            return None
        self.empty()
        columns = [np.concatenate(part) for part in zip(*self._parts, strict=True)]
        if ended:
            columns = self._with_end(columns)
        time, q, v, lo, impulse = columns
        n = self._model.n
        return Trajectory(
            time=time,
            angles=view.headings(q[:, :n]),
            base=view.outer_hinge(q, lo),
            rates=view.rates(v[:, :n]),
            released=n - lo,
            base_velocity=view.outer_velocity(q, v),
            push=np.diff(impulse, prepend=0.0) / np.diff(time, prepend=-interval),
            side=self._model.side,
        )

    def _with_end(self, columns: list[npt.NDArray[Any]]) -> list[npt.NDArray[Any]]:
        """Return the columns of all frames, with the present state as the last frame.

        An earlier frame of the same moment is omitted, because an impact may have followed it.
        """
        state, time = self._state, columns[0]
        now = state.clock[ix.TIME]
        same = len(time) > 0 and now - time[-1] < APART
        last = now, state.q, state.v, state.counter[ix.N_HELD], state.account[ix.IMPULSE]
        return [
            np.concatenate([column[: len(time) - same], [value]])
            for column, value in zip(columns, last, strict=True)
        ]


def magnetic_energy(scene: Scene, motion: Trajectory) -> Array:
    """Return the magnetic energies of the recorded motion of a scene [J], shape (m,).

    They include the magnets that act and an external field, like `Fold.energy`. The scene must be
    concrete, and the whole motion finite.
    """
    # A pinned chain is indexed from component 1, as a trajectory is.
    model = pack(scene.alone())
    found = np.zeros(len(motion))
    if not model.magnetic:
        return found
    work = new_work(model._replace(contact=False, frictional=False))
    acting = loaded(scene, motion.angles, motion.base, motion.released)
    coordinates = np.concatenate([motion.angles, motion.base], axis=1)
    for k, q in enumerate(coordinates):
        charge = model.charge * acting[k, :, None]
        articulated.place(0, model.bodies, q, work.pose)
        found[k] = pairs.energy(0, model.magnets, charge, work.pose, work.nodes)
        if model.field.present:
            frame = model._replace(charge=charge)
            found[k] += outer_field.field_energy(0, frame, work.pose, work.nodes)
    return found
