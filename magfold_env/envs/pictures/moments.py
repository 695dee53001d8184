"""What there is to see of an episode; `magfold_env.render.snapshot` draws it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.chains.episode import EpisodeView
from magfold_env.envs.control.episode import ControlEpisode
from magfold_env.envs.spaces.actions import speed_at
from magfold_env.envs.tasks.control_setup import ControlSetup
from magfold_env.envs.tasks.control_tasks import ControlTask
from magfold_env.envs.tasks.forecast import Forecast
from magfold_env.envs.tasks.goals import Goal
from magfold_env.envs.tasks.task import FoldTask

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

_Rows = list[tuple[str, str]]


def fold_moment(task: FoldTask, episode: EpisodeView, goal: Goal, baseline: Baseline) -> Snapshot:
    """Return what there is to see of an episode in which magnets are chosen."""
    from magfold_env.render.snapshot import Snapshot  # noqa: PLC0415 - needs the extra

    found, n = task.forecast(episode, goal), task.scene.n
    rows: _Rows = [("word", episode.word), ("target", goal.word)]
    if episode.fed:
        rows += _energies(episode.energy, found)
        last = episode.progress.order[episode.fed - 1]
        speed = speed_at(float(episode.progress.speeds[last]))
        rows.append(("last speed", f"{1e3 * speed:.0f} mm/s"))
    if episode.status is not None:
        info = task.summary(episode, goal, baseline)
        rows.append(("score", f"{info['score']:.2f}"))
        if not baseline.flagged:
            rows.append(("baseline", f"{baseline.score:.2f}"))
    return Snapshot(
        scene=episode.scene_so_far,
        angles=episode.state.angles,
        base=episode.state.base,
        released=int(episode.progress.released.sum()),
        target=goal.word,
        held=episode.held,
        is_loaded=episode.fed > 0,
        title=f"fed {episode.fed} of {n}" if episode.status is None else str(episode.status),
        message=episode.message,
        rows=tuple(rows),
        predicted=None if found is None else found.word,
    )


def control_moment(setup: ControlSetup, episode: ControlEpisode, task: ControlTask) -> Snapshot:
    """Return what there is to see of an episode of feed control."""
    from magfold_env.render.snapshot import Snapshot  # noqa: PLC0415 - needs the extra

    found = setup.forecast(episode, task)
    out = int(episode.progress.released.sum())
    rows: _Rows = [
        ("word", episode.word),
        ("target", task.target),
        ("to avoid", task.avoid),
        *_energies(episode.energy, found),
        ("time", f"{episode.time:.2f} s"),
        ("push", _or_dash(episode.force, "mN")),
    ]
    if episode.asked:
        rows.append(("feed speed", f"{1e3 * episode.asked[-1]:.0f} mm/s"))
    if episode.status is not None:
        rows.append(("score", f"{setup.summary(episode, task)['score']:.2f}"))
    return Snapshot(
        scene=episode.scene_so_far,
        angles=episode.state.angles,
        base=episode.state.base,
        released=out,
        target=task.target,
        held=episode.held,
        title=f"{out} of {setup.scene.n} out" if episode.status is None else episode.status,
        message=episode.message,
        rows=tuple(rows),
        predicted=None if found is None else found.word,
    )


def _energies(energy: float, found: Forecast | None) -> _Rows:
    rows: _Rows = [("energy", _or_dash(energy, "mJ"))]
    if found is not None:
        stuck = ", stuck" if found.is_stuck else ""
        rows.append(("as predicted", _or_dash(found.energy, "mJ") + stuck))
        rows.append(("as the target", _or_dash(found.target_energy, "mJ")))
    return rows


def _or_dash(value: float, unit: str) -> str:
    """Return a value in thousandths of its SI unit; a dash for no number."""
    return f"{1e3 * value:.2f} {unit}" if math.isfinite(value) else "–"
