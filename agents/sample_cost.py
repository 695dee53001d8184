"""What physics calls buy: ``python -m agents.sample_cost [SEARCH | NAME=POLICY,... ...]``.

With k physics calls a target each method freezes one candidate, sequence and speeds, chosen on
those calls; it is scored on fresh draws. Without a call a search has what it would try first, and a
trained policy plays as it does, choosing step by step: to freeze what it chooses it must be
watched once, which is a call.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from agents.baselines.searches import SEARCHES, frozen_by
from agents.commands import (
    EnvChanges,
    EnvConfig,
    progress_bar,
    reported_errors,
    run_command,
    text_table,
)
from agents.evaluation import episodes, intervals, policies, report
from agents.evaluation.page import make_figure
from agents.settings import EnvSettings, env_settings
from agents.training.folder import file_digest, provenance
from magfold_env.cli import options
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.files import write_text
from magfold_env.reporting.plotting import COLOURS, GRID, save_figure

CALLS = (0, 1, 3, 10, 30, 100)
GOAL = 1.0
"""Searches go on until the calls are spent, or 40 of 40 succeed."""


@dataclass(frozen=True)
class Point:
    """What some calls for one target bought."""

    target: str
    """The word that is wanted."""
    budget: int
    """Calls that were allowed."""
    chosen: policies.Chosen | None
    """What was frozen; None where a policy plays as it does."""
    success: float
    """Share of the fresh draws that ended in the target."""


Curves = Mapping[str, Sequence[Sequence[Point]]]
"""The points of each seed of each method: all budgets for one target after another."""


def measure(
    methods: Sequence[report.Method],
    settings: EnvSettings,
    budgets: Sequence[int],
    draws: int,
    seed: int = 0,
    processes: int = 1,
) -> Curves:
    """Return what physics calls buy.

    Methods are searches by name, or files of policies; `budgets` are physics calls for each target,
    `draws` fresh ones that a choice is scored on, and `seed` is that of the searches and of their
    calls. So many `processes` each take a target.
    """
    targets = episodes.make_env(settings).targets
    curves: dict[str, list[list[Point]]] = {}
    with progress_bar() as bar:
        for method in methods:
            task = bar.add_task(method.name, total=len(targets) * len(method.policies), note="")
            curves[method.name] = []
            for policy in method.policies:
                jobs = [(policy, settings, word, tuple(budgets), draws, seed) for word in targets]
                points: list[Point] = []
                for each in episodes.spread_over(processes, _points, jobs):
                    points += each
                    bar.update(task, advance=1)
                curves[method.name].append(points)
    return curves


def success(curves: Curves, budgets: Sequence[int]) -> dict[str, list[intervals.Estimate]]:
    """Return the success of each method with each budget, over seeds and targets."""
    found: dict[str, list[intervals.Estimate]] = {}
    for name, runs in curves.items():
        found[name] = []
        for k in budgets:
            points = [[point for point in run if point.budget == k] for run in runs]
            scores = np.array([[point.success for point in run] for run in points])
            found[name].append(intervals.estimate(scores, [point.target for point in points[0]]))
    return found


def _points(
    name: str, settings: EnvSettings, target: str, budgets: Sequence[int], draws: int, seed: int
) -> list[Point]:
    """Return what each budget buys for one target.

    Processes are sent it by value, being of the main module; so what they keep is kept elsewhere.
    """
    env = episodes.own_env(settings)
    seeds = evaluation_seeds(draws)

    def share(policy: policies.Policy) -> float:
        return float(np.mean([episodes.play(policy, env, target, each).success for each in seeds]))

    @cache
    def frozen(choice: policies.OpenLoop) -> float:
        return share(policies.FrozenPolicy({target: choice}))

    points: list[Point] = []
    for budget in budgets:
        if budget == 0 and name not in SEARCHES:
            points.append(Point(target, budget, None, share(episodes.own_trained(name, False))))
        else:
            found = frozen_by(name, env, target, budget, GOAL, seed)
            points.append(Point(target, budget, found, frozen(found.choice)))
    return points


def training_calls(method: report.Method, n: int) -> list[int] | None:
    """Return the physics calls each seed was trained with; None for a search.

    One call is a whole chain, `n` steps where components are chosen one by one.
    """
    if method.policies[0] in SEARCHES:
        return None
    return [policies.TrainedPolicy.load(path).training_steps // n for path in method.policies]


def draw(
    path: Path, found: Mapping[str, Sequence[intervals.Estimate]], budgets: Sequence[int]
) -> None:
    """Write a picture of success over physics calls."""
    figure, ((axes,),) = make_figure(3.8)
    places = np.arange(len(budgets))
    for k, (name, row) in enumerate(found.items()):
        value, low, high = 100 * np.array(row, dtype=float).T
        shift = 0.06 * (k - 0.5 * (len(found) - 1))
        axes.errorbar(
            places + shift, value, yerr=[value - low, high - value], fmt="o-", markersize=4,
            capsize=2, linewidth=1.3, color=COLOURS[(k + 1) % len(COLOURS)], label=name,
        )  # fmt: skip
    axes.set_xticks(places, [str(k) for k in budgets])
    axes.set_ylim(-3, 103)
    axes.set_xlabel("physics calls a target")
    axes.set_ylabel("success on fresh draws [%]")
    axes.grid(axis="y", color=GRID, linewidth=0.8)
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    save_figure(figure, path)


def main(
    methods: Annotated[
        list[str],
        typer.Argument(help=f"Any of {', '.join(SEARCHES)}; policies, NAME=PATH,PATH,..."),
    ],
    config: EnvConfig = "ppo-tube-feed",
    env: EnvChanges = None,
    calls: Annotated[
        str, typer.Option(help="Physics calls a target, separated by commas.")
    ] = ",".join(map(str, CALLS)),
    draws: Annotated[int, typer.Option(min=1, help="Fresh draws a choice is scored on.")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Of the searches and their calls.")] = 0,
    processes: Annotated[int, typer.Option(min=1, help="Targets at a time.")] = 2,
    output: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("runs/sample-cost"),
) -> None:
    """Measure what physics calls at test time buy each method."""
    with reported_errors(ValueError):
        options.need_render(charts=True)
        options.check_folder("--output", output)
        settings, budgets = env_settings(config, env or []), _budgets(calls)
        every = report.parse_methods(methods)
        for policy in (policy for method in every for policy in method.policies):
            if policy not in SEARCHES:
                if not Path(policy).is_file():
                    raise ValueError(policies.none_called(policy, SEARCHES))
                policies.TrainedPolicy.load(policy)
                episodes.check(policy, settings)
        episodes.warm_up(settings)
        curves = measure(every, settings, budgets, draws, seed, processes)
    found = success(curves, budgets)
    n = episodes.make_env(settings).scene.n
    content = {
        "env": settings.model_dump(mode="json"),
        "calls": budgets,
        "draws": draws,
        "seed": seed,
        "provenance": provenance(),
        "methods": {
            method.name: {
                "policies": [{"policy": p, "sha256": file_digest(p)} for p in method.policies],
                "training calls": training_calls(method, n),
                "success": [[float(part) for part in each] for each in found[method.name]],
                "runs": [[asdict(point) for point in run] for run in curves[method.name]],
            }
            for method in every
        },
    }
    output.mkdir(parents=True, exist_ok=True)
    write_text(output / "sample-cost.json", json.dumps(content) + "\n")
    draw(output / "sample-cost.png", found, budgets)
    rows = [
        {"": name, **{str(k): str(each) for k, each in zip(budgets, row, strict=True)}}
        for name, row in found.items()
    ]
    options.show(text_table("Success with so many physics calls a target", rows))
    options.say_written(output / "sample-cost.json", output / "sample-cost.png")


def _budgets(text: str) -> list[int]:
    """Return the numbers in a list separated by commas."""
    parts = text.split(",")
    if not all(part.strip().isdigit() for part in parts):
        raise ValueError(f"--calls: {text!r} is not allowed; must be numbers such as 0,1,10")
    return sorted({int(part) for part in parts})


if __name__ == "__main__":
    run_command(main)
