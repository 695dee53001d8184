"""Other tasks of Gymnasium beside ours, all on one core and in turns, random actions throughout.

A step is not the same thing everywhere: one of tube feed moves a whole component out of the tube,
one of feed control simulates 20 ms, Acrobot's 200 ms, Swimmer's 40 ms and HalfCheetah's 50 ms.
"""

from __future__ import annotations

import importlib
from importlib.util import find_spec
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from magfold_env.benchmarks.env import players
from magfold_env.benchmarks.env.players import TUBE_FEED
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table

SEED = 41
SINGLE, VECTOR = "single", "vector"


class Contender(NamedTuple):
    """An environment, and how many steps of it are a sample."""

    title: str
    env_id: str
    steps: int
    fidelity: str | None = None

    @property
    def options(self) -> dict[str, Any]:
        """What it is made with."""
        return {} if self.fidelity is None else {"fidelity": self.fidelity}

    @property
    def needs_mujoco(self) -> bool:
        """Whether it is one of MuJoCo's."""
        return self.env_id in ("Swimmer-v5", "HalfCheetah-v5")


CONTENDERS = (
    Contender("tube feed, dynamics", TUBE_FEED, 384),
    Contender("tube feed, quasistatic", TUBE_FEED, 6000, "quasistatic"),
    Contender("feed control", "MagFold/FeedControl-v0", 4000),
    Contender("Acrobot-v1", "Acrobot-v1", 2000),
    Contender("Swimmer-v5", "Swimmer-v5", 2000),
    Contender("HalfCheetah-v5", "HalfCheetah-v5", 2000),
)


class Effort(NamedTuple):
    """How much work a run of the benchmark may be."""

    share: float  # of the steps of every sample
    envs: int  # in a vector
    rounds: int

    def steps(self, contender: Contender) -> int:
        """Return the steps of a sample, a whole number in every environment."""
        return max(1, round(self.share * contender.steps / self.envs)) * self.envs


QUICK, FULL = Effort(0.05, 4, 2), Effort(1.0, 16, 9)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every contender that is installed, alone and side by side."""
    effort = QUICK if quick else FULL
    there = [each for each in CONTENDERS if not each.needs_mujoco or installed()]
    if installed():
        # Keep MuJoCo from writing its warnings to a file where the user happens to be.
        mujoco: Any = importlib.import_module("mujoco")
        mujoco.set_mju_user_warning(str)  # what is returned goes nowhere
    lengths: dict[str, float] = {}
    for each in there:
        env = players.single(each.env_id, **each.options)
        env.reset(seed=SEED)
        lengths[each.title] = players.episode_length(env, effort.steps(each))
    tasks = {
        (each, form): players.stepping(
            each.env_id,
            effort.envs if form == VECTOR else None,
            effort.steps(each),
            SEED,
            **each.options,
        )
        for each, form in product(there, (SINGLE, VECTOR))
    }
    times = timing.take_turns(
        tasks, effort.rounds, 0.0, tick=lambda share: progress(share, "steps")
    )
    rows: list[Row] = []
    for (each, form), taken in times.items():
        length = lengths[each.title]
        row: Row = {"task": each.title, "form": form}
        row |= players.rate_cells("steps", taken, effort.steps(each))
        row |= {"steps an episode": length, "episodes/s": float(row["steps/s"]) / length}
        rows.append(row)
    findings: list[str] = []
    if not installed():
        names = " and ".join(each.title for each in CONTENDERS if each.needs_mujoco)
        findings.append(
            f"{names} are left out: MuJoCo is absent; the extra brings it: "
            "pip install 'magfold_env[peers]'"
        )
    title = f"Steps and episodes a second on one core, alone and {effort.envs} side by side"
    return Measurement(rows, [Table(title, rows)], findings)


def installed() -> bool:
    """Whether MuJoCo is there, and what Gymnasium needs besides to use it."""
    return all(find_spec(name) is not None for name in ("mujoco", "imageio"))


def draw(rows: list[Row]) -> Any:
    """Draw steps and episodes a second of all tasks, alone and side by side."""
    figure, axes = plotting.panels(
        2, "Beside other tasks, one core, random actions", 6.0, 3.8, shared=False
    )
    titles = tables.distinct(rows, "task")
    for axis, what in zip(axes, ("steps/s", "episodes/s"), strict=True):
        for k, form in enumerate((SINGLE, VECTOR)):
            axis.plot(
                tables.numbers(tables.select(rows, form=form), what),
                np.arange(len(titles)),
                color=plotting.COLOURS[k + 1],
                linestyle="none",
                marker=plotting.MARKERS[k],
                markersize=8,
                label=form,
            )
        axis.set_yticks(np.arange(len(titles)), titles)
        axis.set_ylim(-0.5, len(titles) - 0.5)
        axis.set_xscale("log")
        axis.set_xlabel(what)
        axis.invert_yaxis()
    plotting.legend_below(figure, axes[0])
    return figure
