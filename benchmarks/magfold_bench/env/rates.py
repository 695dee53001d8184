"""Episodes and steps a second: tube feed with and without dynamics, and other tasks beside it.

Tube-feed episodes are simulated at the default tolerance, until the chains have settled; magnets
are random, speeds log-uniform over their whole range. In a round everyone plays the same episodes,
one after another or side by side; every round has others, for some take a hundred times as long as
others. On one core processor time counts, with threads the clock's.

Steps without dynamics, and those of other tasks of Gymnasium, are taken with random actions,
beginning anew included, on one core and in turns. A step is not the same thing everywhere: one of
tube feed moves a whole component out of the tube, one on an unknown floor simulates 20 ms,
Acrobot's 200 ms, Swimmer's 40 ms and HalfCheetah's 50 ms.
"""

import importlib
import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from itertools import count, product
from typing import Any, NamedTuple

import numpy as np

from magfold_bench.env import players
from magfold_bench.env.players import ENVS, QUARTILES, TUBE_FEED, rate_cells, rate_verdict
from magfold_bench.presentation import name_bars, panels_by, quartile_bars
from magfold_env.files import pip_install
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick

LENGTHS = (4, 6, 8, 12)
SEED, STEPS_SEED, PEERS_SEED = 17, 5, 41
COMPONENTS = 6  # of the chains that most is asked of
FORMS = {"single": None, f"vector of {ENVS}": ENVS}
SHAPINGS = {"none": False, "similarity": "similarity"}
STEPS_WANTED = 20_000.0  # steps a second without dynamics


class Way(NamedTuple):
    """One way to play."""

    form: str  # `SINGLE` or `VECTOR`
    threads: int

    def __str__(self) -> str:
        return f"{self.form}, {self.threads} thread{'s' * (self.threads > 1)}"


SINGLE, VECTOR = "single", "vector"
CORE, WALL = "processor time", "wall clock"
CLOCKS: dict[str, Callable[[], float]] = {CORE: time.process_time, WALL: time.perf_counter}
WAYS = {
    CORE: (Way(SINGLE, 1), Way(VECTOR, 1)),
    WALL: (Way(VECTOR, 1), Way(VECTOR, 2)),
}
"""Who takes turns with whom, by the clock that they are timed with."""
WANTED = {
    (CORE, Way(SINGLE, 1), COMPONENTS): 250.0,
    (CORE, Way(VECTOR, 1), COMPONENTS): 350.0,
    (WALL, Way(VECTOR, 2), COMPONENTS): 620.0,
    (CORE, Way(VECTOR, 1), 12): 20.0,
}
"""Episodes a second that are asked for, by clock, way and length."""


class EpisodesEffort(NamedTuple):
    """How much work a run of the benchmark may be."""

    lengths: tuple[int, ...]
    envs: int
    rounds: int


QUICK_EPISODES = EpisodesEffort((COMPONENTS,), 4, 2)
FULL_EPISODES = EpisodesEffort(LENGTHS, ENVS, 7)


def episodes(quick: bool, progress: Progress) -> Measurement:
    """Measure episodes of every length."""
    effort = QUICK_EPISODES if quick else FULL_EPISODES
    rows: list[Row] = []
    cases = list(product(effort.lengths, WAYS))
    for (n, clock), tick in tables.each_case(progress, cases, lambda case: f"n = {case[0]}"):
        rows.extend(measure(n, clock, effort, tick))
    title = f"Tube-feed episodes a second, dynamics, {effort.envs} in a round"
    return Measurement(rows, [Table(title, rows)], _episodes_findings(rows))


def measure(n: int, clock: str, effort: EpisodesEffort, tick: Tick) -> list[Row]:
    """Return a row for each way to play chains of n components that is timed with a clock."""
    ways = WAYS[clock]
    tasks = {way: _task(n, way, effort.envs) for way in ways}
    times = timing.take_turns(tasks, effort.rounds, 0.0, CLOCKS[clock], tick)
    rows: list[Row] = []
    for way, mine in times.items():
        row: Row = {"n": n, "clock": clock, "form": way.form, "threads": way.threads}
        row |= rate_cells("episodes", mine, effort.envs)
        rows.append(row | {"times the first": timing.ratio(times[ways[0]], mine).median})
    return rows


def _task(n: int, way: Way, envs: int) -> timing.Task:
    """Return the task to play so many episodes."""
    options: dict[str, Any] = {"components": n, "actions": "box", "baseline": None}
    if way.form == SINGLE:
        play = partial(players.play_single, players.single(TUBE_FEED, **options))
    else:
        together = players.vector(TUBE_FEED, envs, way.threads, **options)
        play = partial(players.play_vector, together)
    rounds = count()

    def prepare() -> Callable[[], None]:
        k = next(rounds)
        actions = players.log_uniform(np.random.default_rng([SEED, n, k]), n, envs)
        return lambda: play(SEED + k * envs, actions)

    return prepare


def _episodes_findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    for (clock, way, n), wanted in WANTED.items():
        for row in tables.select(rows, n=n, form=way.form, threads=way.threads, clock=clock):
            rate = float(row["episodes/s"])
            cores = "one core" if way.threads == 1 else f"{way.threads} threads"
            found.append(
                f"n = {n}, {way.form}, {cores}: {rate:.0f} episodes/s; {rate_verdict(rate, wanted)}"
            )
    return found


def draw_episodes(rows: list[Row]) -> Any:
    """Episodes a second against the length, a panel a clock."""
    title, labels = "Tube-feed episodes a second, dynamics", ("components n", "episodes a second")
    figure, panels = panels_by(rows, ("clock",), title, labels)
    for axis, here in panels:
        clock = str(here[0]["clock"])
        for k, way in enumerate(WAYS[clock]):
            mine = tables.select(here, form=way.form, threads=way.threads)
            n, rates = (tables.numbers(mine, name) for name in ("n", "episodes/s"))
            style = {"color": plotting.COLOURS[k + 1], "marker": plotting.MARKERS[k]}
            spread = quartile_bars(mine, "episodes/s", *QUARTILES)
            axis.errorbar(n, rates, spread, markersize=5, capsize=3, label=f"{way}", **style)
        for (where, _, n), wanted in WANTED.items():
            if where == clock:
                axis.plot(n, wanted, "_", color=plotting.INK, markersize=22, markeredgewidth=2)
                axis.annotate(
                    f"asked for: {wanted:g}",
                    (n, wanted),
                    (14, -3),
                    textcoords="offset points",
                    fontsize=9,
                    color=plotting.INK,
                )
        axis.set_yscale("log")
        axis.set_xticks(sorted(tables.distinct(rows, "n")))
        plotting.legend(axis, "lower left")
    return figure


def quasistatic(quick: bool, progress: Progress) -> Measurement:
    """Measure steps without dynamics in every form, with and without shaping."""
    steps, rounds = (10 * ENVS, 3) if quick else (100 * ENVS, 15)
    tasks = {
        (form, shaping): players.stepping(
            TUBE_FEED, envs, steps, STEPS_SEED, fidelity="quasistatic", shaping=kind
        )
        for (form, envs), (shaping, kind) in product(FORMS.items(), SHAPINGS.items())
    }
    times = timing.take_turns(tasks, rounds, 0.0, tick=lambda share: progress(share, "steps"))
    rows: list[Row] = []
    findings: list[str] = []
    for (form, shaping), mine in times.items():
        row: Row = {"form": form, "shaping": shaping, **rate_cells("steps", mine, steps)}
        rows.append(row | {"µs a step": 1e6 * mine.median / steps})
        rate = float(row["steps/s"])
        findings.append(
            f"{form}, shaping {shaping}: {rate:,.0f} steps/s on one core; "
            f"{rate_verdict(rate, STEPS_WANTED)}"
        )
    title = "Quasistatic tube-feed steps a second on one core, n = 6"
    return Measurement(rows, [Table(title, rows)], findings)


def draw_quasistatic(rows: list[Row]) -> Any:
    """Draw steps a second as bars."""
    figure, (axis,) = plotting.panels(1, "Quasistatic tube-feed steps a second, one core", 7.0, 3.2)
    rates, spread = tables.numbers(rows, "steps/s"), quartile_bars(rows, "steps/s", *QUARTILES)
    axis.barh(range(len(rows)), rates, xerr=spread, color=plotting.COLOURS[1], capsize=3)
    name_bars(axis, [f"{row['form']}, shaping {row['shaping']}" for row in rows], "steps/s")
    axis.axvline(STEPS_WANTED, color=plotting.INK, linestyle="--", linewidth=1.0)
    return figure


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
    Contender("unknown floor", "MagFold/UnknownFloor-v0", 4000),
    Contender("reprogram", "MagFold/Reprogram-v0", 4000),
    Contender("lumen", "MagFold/Lumen-v0", 4000),
    Contender("tray", "MagFold/Tray-v0", 500),
    Contender("anchor", "MagFold/Anchor-v0", 500),
    Contender("Acrobot-v1", "Acrobot-v1", 2000),
    Contender("Swimmer-v5", "Swimmer-v5", 2000),
    Contender("HalfCheetah-v5", "HalfCheetah-v5", 2000),
)


class PeersEffort(NamedTuple):
    """How much work a run of the benchmark may be."""

    share: float  # of the steps of every sample
    envs: int  # in a vector
    rounds: int

    def steps(self, contender: Contender) -> int:
        """Return the steps of a sample, a whole number in every environment."""
        return max(1, round(self.share * contender.steps / self.envs)) * self.envs


QUICK_PEERS, FULL_PEERS = PeersEffort(0.05, 4, 2), PeersEffort(1.0, 16, 9)


def peers(quick: bool, progress: Progress) -> Measurement:
    """Measure every contender that is installed, alone and side by side."""
    effort = QUICK_PEERS if quick else FULL_PEERS
    there = [each for each in CONTENDERS if not each.needs_mujoco or mujoco_installed()]
    if mujoco_installed():
        # Keep MuJoCo from writing its warnings to a file where the user happens to be.
        mujoco: Any = importlib.import_module("mujoco")
        mujoco.set_mju_user_warning(str)  # what is returned goes nowhere
    lengths: dict[str, float] = {}
    for each in there:
        env = players.single(each.env_id, **each.options)
        env.reset(seed=PEERS_SEED)
        lengths[each.title] = players.episode_length(env, effort.steps(each))
    tasks = {
        (each, form): players.stepping(
            each.env_id,
            effort.envs if form == VECTOR else None,
            effort.steps(each),
            PEERS_SEED,
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
    if not mujoco_installed():
        names = " and ".join(each.title for each in CONTENDERS if each.needs_mujoco)
        findings.append(
            f"{names} are left out: MuJoCo is absent; the extra brings it: {pip_install('peers')}"
        )
    title = f"Steps and episodes a second on one core, alone and {effort.envs} side by side"
    return Measurement(rows, [Table(title, rows)], findings)


def mujoco_installed() -> bool:
    """Whether MuJoCo is there, and what Gymnasium needs besides to use it."""
    return all(find_spec(name) is not None for name in ("mujoco", "imageio"))


def draw_peers(rows: list[Row]) -> Any:
    """Draw steps and episodes a second of all tasks, alone and side by side."""
    title = "Beside other tasks, one core, random actions"
    figure, axes = plotting.panels(2, title, 6.0, 3.8, shared=False)
    titles = tables.distinct(rows, "task")
    for axis, what in zip(axes, ("steps/s", "episodes/s"), strict=True):
        for k, form in enumerate((SINGLE, VECTOR)):
            rates = tables.numbers(tables.select(rows, form=form), what)
            style = {"color": plotting.COLOURS[k + 1], "marker": plotting.MARKERS[k]}
            style |= {"linestyle": "none", "markersize": 8, "label": form}
            axis.semilogx(rates, range(len(titles)), **style)
        axis.set_ylim(-0.5, len(titles) - 0.5)
        name_bars(axis, titles, what)
    plotting.legend_below(figure, axes[0])
    return figure
