"""A simulated chain that is pushed at a speed which may change at any time."""

import math
from functools import cached_property

import numpy as np

from magfold_env.engine.chain import feed
from magfold_env.engine.contact import constraints
from magfold_env.engine.friction import held
from magfold_env.engine.magnets import chain
from magfold_env.engine.state import LO, TIME, Array, Loads, Model, State, Work
from magfold_env.engine.workspace import new_work
from magfold_env.fold import FoldStatus
from magfold_env.simulation.env_session import EnvSession, copied


class PushedSession(EnvSession):
    """A chain in the tube whose feed is controlled from moment to moment."""

    @property
    def jammed(self) -> bool:
        """Whether the run broke down because the feed drove what cannot give way."""
        return self.status is FoldStatus.FAILED and self.message.startswith("jammed")

    @property
    def progress_of_next(self) -> float:
        """How far the component in the mouth is out, from 0 to 1; 1 if none is left inside."""
        lo = int(self._state.counter[LO])
        if lo == 0:
            return 1.0
        link = self._model.bodies.length[lo - 1] * math.cos(self._state.q[lo - 1])
        return min(max(float(self._state.q[self.n] / link), 0.0), 1.0)

    def push(self, speeds: Array, seconds: float) -> None:
        """Feed for some time [s] or until the run ends.

        A component that passes the mouth meanwhile is released. With none left inside the
        chain folds freely.

        Parameters
        ----------
        speeds : array, shape (n,)
            Speed while each component is in the mouth [m/s], 0 or more, component 1 first.
        seconds : float
            For how long.
        """
        model, state = self._model, self._state
        until = float(state.clock[TIME]) + seconds
        while self._status is None and state.clock[TIME] < until:
            lo = int(state.counter[LO])
            if lo == 0:
                self._advance(until)
                continue
            if self._waiting is not None:
                model.charge[lo - 1] = self._waiting[lo - 1]
            speed = float(speeds[self._view.index(lo - 1)])
            feed.change_speed(model, state, self._work, speed)
            release = math.inf
            if speed > 0.0:
                release = float(state.clock[TIME]) + max(feed.time_to_release(model, state), 0.0)
            stop = min(release, until)
            if lo == model.n:
                # Nothing is outside yet that could move by itself.
                state.q[model.n] += speed * (stop - state.clock[TIME])
                state.clock[TIME] = stop
            elif not self._advance(stop):
                return
            if release <= until:
                feed.release(model, state)

    def push_force(self) -> float:
        """Return the force along the tube that the feed needs at this moment [N].

        By Newton's law for the chain: the mass times the acceleration of what is outside, less
        the friction of the floor and the forces of the walls on it; inside the tube nothing
        rubs. Negative where the chain pulls. The pull of a fixed external magnet on components
        inside the tube is left out. No number where the contact forces are not found.
        """
        model, state, work = self._model, copied(self._state), self._probe
        lo, n = int(state.counter[LO]), model.n
        if lo in (0, n):
            return 0.0
        if constraints.begin_step(model, state, work) not in (constraints.OK, constraints.IMPACT):
            return math.nan
        # Rows that are not used have no force then.
        work.rows.multiplier[:] = 0.0
        work.rows.jacobian[:] = 0.0
        out = work.stages.slope_v[0]
        if not held.first_accelerations(model, state, work, out):
            return math.nan
        momentum = _momentum_rate(lo, model, work, out)
        outside = work.chain.force[n] + float(work.rows.multiplier @ work.rows.jacobian[:, n])
        return momentum - outside + _pull_of_held(lo, model, state, work)

    @cached_property
    def _probe(self) -> Work:
        """Scratch space, so that to measure a force changes nothing."""
        return new_work(self._model)


def _momentum_rate(lo: int, model: Model, work: Work, acceleration: Array) -> float:
    """Mass times acceleration along x of the free components [N], centripetal parts left out."""
    bodies = model.bodies
    swing = -work.pose.sin[lo:] * acceleration[lo : model.n]
    hinges = np.concatenate([[0.0], np.cumsum(bodies.length[lo:] * swing)[:-1]])
    return float(bodies.mass[lo:] @ (hinges + bodies.reach[lo:] * swing))


def _pull_of_held(lo: int, model: Model, state: State, work: Work) -> float:
    """Force along x of the magnets inside the tube on those outside [N]."""
    if not model.magnetic:
        return 0.0
    first = feed.place_all(lo, model, state.q, work.pose)
    loads = Loads(*(np.zeros(model.n) for _ in range(3)))
    chain.add_chain_forces(first, lo, model, state.q, work.pose, work.nodes, work.rigid, loads)
    return float(loads.fx[lo:].sum())
