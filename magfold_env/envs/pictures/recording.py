"""Recordings of episodes for the page that plays them."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from magfold_env.envs.chains.arrays import FAILED
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.episodes import Episodes
from magfold_env.envs.spaces.actions import letters_of
from magfold_env.fold import Trajectory, along
from magfold_env.replay import Recording
from magfold_env.simulation.frames import magnetic_energy

EMPTY = "----"
"""Faces of a component that has not been chosen."""

_APART = 1e-6  # [s] the page treats frames closer than this as simultaneous
_ROW = np.array([0])


def recording(episodes: Episodes[Any], choices: Sequence[Any]) -> Recording:
    """Play a single episode, which records frames, by the choices of its steps."""
    arrays, chains = episodes.arrays, cast("DynamicChains", episodes.chains)
    if chains.motion() is None:
        raise ValueError("fidelity: 'quasistatic' is not allowed; there is no motion to play")
    sequence = [EMPTY] * episodes.world.scene.n
    changes: list[tuple[float, list[str]]] = []
    for choice in choices:
        before, time = sequence.copy(), float(chains.times(_ROW)[0])
        episodes.step(_ROW, choice)
        for k in np.flatnonzero(episodes.chosen(0)):
            sequence[k] = letters_of(arrays.signs[0, k])
        if any(old not in (EMPTY, new) for old, new in zip(before, sequence, strict=True)):
            changes.append((time, before))
    motion = _with_end(episodes)
    scene = episodes.scene(0).replace(sequence=sequence)
    ends = {"status": "under way", "message": ""}
    if episodes.terminated[0]:
        ends = {key: str(value[0]) for key, value in episodes.final_infos(_ROW).items()}
    return Recording(
        scene=scene,
        word=str(episodes.words(_ROW)[0]),
        status=ends["status"],
        message=ends["message"],
        energy=float(chains.energies(_ROW)[0]),
        duration=float(chains.times(_ROW)[0]),
        **along(scene, motion),
        magnetic=magnetic_energy(scene, motion) if episodes.has_true_strengths else None,
        feed=f"{scene.feed.direction}, as chosen in each step, {scene.feed.loading}",
        earlier=[
            (
                int(np.searchsorted(motion.time, time, side="right")),
                [new if old == EMPTY else old for old, new in zip(faces, sequence, strict=True)],
            )
            for time, faces in changes
        ],
    )


def _with_end(episodes: Episodes[Any]) -> Trajectory:
    """Return the frames of a single episode; the last one shows the present chain."""
    arrays, chains = episodes.arrays, cast("DynamicChains", episodes.chains)
    motion = cast("Trajectory", chains.motion())
    time = chains.times(_ROW)
    if arrays.status[0] == FAILED or time[0] <= motion.time[-1] + _APART:
        return motion
    span = np.diff(motion.time, prepend=-motion.time[1] if len(motion) > 1 else -1.0)
    push = (chains.impulses(_ROW) - motion.push @ span) / (time - motion.time[-1])
    now: dict[str, Any] = {
        "time": time,
        "angles": arrays.angles,
        "base": arrays.base,
        "rates": arrays.rates,
        "released": arrays.released.sum(axis=1),
        "base_velocity": arrays.base_velocity,
        "push": push,
    }
    both = {name: np.concatenate([getattr(motion, name), now[name]]) for name in now}
    return Trajectory(**both)
