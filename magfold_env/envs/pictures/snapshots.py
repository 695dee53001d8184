"""The content of an episode's pictures, and recordings for the web page that plays the episode."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from magfold_env.envs.chains.arrays import FAILED
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.chains.quasistatic import predict
from magfold_env.envs.episodes import Episodes, Lines
from magfold_env.envs.spaces.actions import letters_of
from magfold_env.fold import Trajectory, along
from magfold_env.replay import Recording
from magfold_env.simulation.frames import magnetic_energy

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

EMPTY = "----"
"""Faces of a component that has not been chosen."""

_APART = 1e-6  # [s] the page treats frames closer than this as simultaneous
_ROW = np.array([0])


def snapshot_of(episodes: Episodes[Any], row: int) -> "Snapshot":
    """Return the content of a picture of an episode.

    The prediction is the fold that the minimiser reaches joint by joint, at the scene's nominal
    strengths. There is no prediction before a component has magnets, in an external field, or with
    ``fidelity="quasistatic"``.
    """
    from magfold_env.render.snapshot import Snapshot  # noqa: PLC0415 - needs the extra

    one, arrays = episodes.rows[row : row + 1], episodes.arrays
    setup, signs, fed = episodes.setup, arrays.signs[row], int(arrays.fed[row])
    title, wanted, done = episodes.caption(row)
    lines: Lines = [("word", episodes.words(one)[0]), *wanted]
    if fed:
        lines.append(("energy", or_dash(float(episodes.chains.energies(one)[0]), "mJ")))
    found = None
    if fed and not setup.in_field and setup.fidelity != "quasistatic":
        rules, order = episodes.lattice(row), list(arrays.order(row))
        found = predict(rules, signs[order[: len(order) if rules.packed.preloaded else fed]])
        energy, wanted = (
            rules.energy_as(word, signs, fed) for word in (found.word, episodes.goals.names[row])
        )
        stuck = ", stuck" if found.is_stuck else ""
        lines.append(("as predicted", or_dash(energy, "mJ") + stuck))
        lines.append(("as the target", or_dash(wanted, "mJ")))
    lines += done
    message = ""
    if episodes.terminated[row]:
        ends = {key: column[0] for key, column in episodes.final_infos(one).items()}
        title, message = ends["status"], ends["message"]
        lines.append(("score", f"{ends['score']:.2f}"))
        if not ends.get("baseline_missing", True):
            lines.append(("baseline", f"{ends['baseline']:.2f}"))
    return Snapshot(
        scene=episodes.scene(row),
        angles=arrays.angles[row].copy(),
        base=arrays.base[row].copy(),
        released=int(arrays.released[row].sum()),
        target=episodes.goals.names[row],
        held=episodes.chains.held(row),
        chosen=episodes.chosen(row),
        title=title,
        message=message,
        rows=tuple(lines),
        predicted=None if found is None else found.word,
        is_loaded=fed > 0,
    )


def or_dash(value: float, unit: str) -> str:
    """Return a value in thousandths of its SI unit, or a dash for NaN."""
    return f"{1e3 * value:.2f} {unit}" if math.isfinite(value) else "–"


def recording(episodes: Episodes[Any], choices: Sequence[Any]) -> Recording:
    """Play the decoded actions `choices` in an episode and return the recording of its motion."""
    arrays, chains = episodes.arrays, cast("DynamicChains", episodes.chains)
    if chains.motion() is None:
        raise ValueError("fidelity: 'quasistatic' is not allowed; there is no motion to play")
    sequence = [EMPTY] * episodes.setup.scene.n
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
    """Return the frames of a single episode; the last frame shows the present chain."""
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
    return replace(motion, **both)
