"""Other tasks of Gymnasium beside ours, all on one core and in turns, random actions throughout.

A step is not the same thing everywhere: one of tube feed moves a whole component out of the tube,
one of feed control simulates 20 ms, Acrobot's 200 ms, Swimmer's 40 ms and HalfCheetah's 50 ms.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

from magfold_env.benchmarks.env.players import TUBE_FEED, episode_length, single, stepping
from magfold_env.benchmarks.env.rates import rate_cells
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Task, take_turns

NAME = "peers"
SEED = 41
SINGLE, VECTOR = "single", "vector"


@dataclass(frozen=True)
class Contender:
    """An environment, and how many steps of it are a sample."""

    title: str
    env_id: str
    steps: int
    options: dict[str, Any] = field(default_factory=dict[str, Any])

    @property
    def needs_mujoco(self) -> bool:
        """Whether it is one of MuJoCo's."""
        return self.env_id in ("Swimmer-v5", "HalfCheetah-v5")


CONTENDERS = (
    Contender("tube feed, dynamics", TUBE_FEED, 384),
    Contender("tube feed, quasistatic", TUBE_FEED, 6000, {"fidelity": "quasistatic"}),
    Contender("feed control", "MagFold/FeedControl-v0", 4000),
    Contender("Acrobot-v1", "Acrobot-v1", 2000),
    Contender("Swimmer-v5", "Swimmer-v5", 2000),
    Contender("HalfCheetah-v5", "HalfCheetah-v5", 2000),
)


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    share: float
    """Of the steps of every sample."""
    envs: int
    """In a vector."""
    rounds: int

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        return cls(0.05, 4, 2) if quick else cls(1.0, 16, 9)

    def steps(self, contender: Contender) -> int:
        """Return the steps of a sample, a whole number in every environment."""
        return max(1, round(self.share * contender.steps / self.envs)) * self.envs


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every contender that is installed, alone and side by side."""
    effort = Effort.of(quick)
    there = [each for each in CONTENDERS if not each.needs_mujoco or installed()]
    if installed():
        _be_quiet()
    lengths: dict[str, float] = {}
    for each in there:
        env = single(each.env_id, **each.options)
        env.reset(seed=SEED)
        lengths[each.title] = episode_length(env, effort.steps(each))
    ways = [(each, form) for each in there for form in (SINGLE, VECTOR)]
    tasks = {f"{each.title} {form}": _task(each, form, effort) for each, form in ways}
    times = take_turns(tasks, effort.rounds, 0.0, tick=lambda share: progress(share, "steps"))
    rows: list[Row] = []
    for each, form in ways:
        steps, length = effort.steps(each), lengths[each.title]
        row: Row = {"task": each.title, "form": form}
        row |= rate_cells("steps", times[f"{each.title} {form}"], steps)
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
    return Measurement(NAME, rows, [Table(title, rows)], findings)


def installed() -> bool:
    """Whether MuJoCo is there, and what Gymnasium needs besides to use it."""
    return all(find_spec(name) is not None for name in ("mujoco", "imageio"))


def _be_quiet() -> None:
    """Keep MuJoCo from writing its warnings to a file where the user happens to be."""
    mujoco: Any = importlib.import_module("mujoco")
    mujoco.set_mju_user_warning(str)  # what is returned goes nowhere


def _task(contender: Contender, form: str, effort: Effort) -> Task:
    envs = effort.envs if form == VECTOR else None
    steps = effort.steps(contender)
    return stepping(contender.env_id, envs, steps, SEED, **contender.options)
