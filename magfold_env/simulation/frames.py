"""The frames of one run: taken by the kernels, moved out of their room when it is full.

And the magnetic energies of what was recorded.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.engine import entries as at
from magfold_env.engine.chain import articulated
from magfold_env.engine.magnets import outer_field, pairs
from magfold_env.engine.state import Array, Model, Record, State
from magfold_env.engine.stepping.integrator import LONGEST_STEP
from magfold_env.engine.workspace import new_record, new_work
from magfold_env.fold import Trajectory, loaded
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack
from magfold_env.simulation.view import Orientation

ROOM = 4096  # frames kept before they are moved out of the kernels' record


class Frames:
    """What was recorded of a chain so far: frames at a rate [1/s], or nothing if that is None."""

    def __init__(self, model: Model, state: State, frame_rate: float | None) -> None:
        interval = 0.0 if frame_rate is None else 1.0 / frame_rate
        capacity = ROOM + int(LONGEST_STEP / interval) if interval else 0
        self._model, self._state = model, state
        self._parts: list[list[npt.NDArray[Any]]] = []
        self.record: Record = new_record(model, interval, capacity)
        """Where the kernels put frames."""

    def empty(self) -> None:
        """Make room in the record."""
        count, record = int(self._state.counter[at.FRAMES]), self.record
        columns = record.time, record.q, record.v, record.lo, record.impulse
        self._parts.append([column[:count].copy() for column in columns])
        self._state.counter[at.FRAMES] = 0

    def trajectory(self, view: Orientation) -> Trajectory | None:
        """Return all frames as they are seen from outside; None if nothing is recorded."""
        if self.record.interval == 0.0:
            return None
        self.empty()
        time, q, v, lo, impulse = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        n = self._model.n
        return Trajectory(
            time=time,
            angles=view.headings(q[:, :n]),
            base=view.outer_hinge(q, lo),
            rates=view.rates(v[:, :n]),
            released=n - lo,
            base_velocity=view.outer_velocity(q, v),
            push=np.diff(impulse, prepend=0.0) / self.record.interval,
        )


def magnetic_energy(scene: Scene, motion: Trajectory) -> Array:
    """Return the magnetic energies of the recorded motion of a scene [J], shape (m,).

    Of the magnets that act, an outer field's included, as `Fold.energy` is. Nothing in the scene
    may be left to chance, and all of the motion must be finite.
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
