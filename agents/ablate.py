"""Ablation of a trained policy: ``python -m agents.ablate POLICY``.

The policy plays tube feed unchanged and with parts of it removed (see
`agents.evaluation.episodes`), on the same targets and draws. The choices of the frozen policy are
also played with chains built beforehand, whose magnets also act inside the tube. Intervals are 95
%, by the bootstrap over training seeds and targets together; those of differences are paired by
seed, target and draws. An interrupted command continues when it is called again; a finished one
prints its table again.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich import table

from agents.commands import EnvChanges, EnvConfig, reported_errors, run_command, text_table
from agents.evaluate import evaluate
from agents.evaluation import episodes, intervals, report
from agents.evaluation.episodes import Method
from agents.evaluation.report import Played, by_target, targets_of
from agents.settings import EnvSettings, env_settings
from magfold_env.cli import options
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.reporting.intervals import share
from magfold_env.scoring.results import Row

SEEING, BUILT = "seeing", "built beforehand"


def measure(
    method: Method, settings: EnvSettings, draws: int, processes: int, folder: Path
) -> dict[str, Row]:
    """Play every ablation on every target with the same draws, which training never uses.

    `folder` stores episodes, and stored episodes are not played again. The number of parallel
    processes is `processes`.

    Raises
    ------
    ValueError
        If chains are chosen as a whole, without observations in between; if `folder` contains other
        episodes; or if a policy cannot play these.
    """
    env = episodes.make_env(settings)
    if env.actions.components > 1:
        raise ValueError(
            f"env.id: {settings.id!r} is not allowed; must be MagFold/TubeFeed-v0 or "
            "MagFold/TubeFeedGoal-v0, where a policy may see what its choices have done"
        )
    speeds = {f"{speed:.3f} m/s": speed for speed in env.actions.speeds.tolist()}
    words = (episodes.NO_MOTION, episodes.FROZEN)
    changes: dict[str, episodes.Change] = {
        SEEING: None, **{word: word for word in words}, **speeds,
        episodes.RANDOM_SPEEDS: episodes.RANDOM_SPEEDS,
    }  # fmt: skip
    dynamics = env.task.fidelity == "dynamics"
    methods = [
        Method(name, method.policies, change, dynamics and change == episodes.FROZEN)
        for name, change in changes.items()
    ]
    results = evaluate(methods, settings, draws, processes, folder=folder / "episodes")
    rows = summarise(results, dynamics)
    files = report.files_of(method.policies)
    return {name: row.model_copy(update={"files": files}) for name, row in rows.items()}


def summarise(results: Played, built: bool = False) -> dict[str, Row]:
    """Return a row for each ablation, and for the frozen policy with chains `built` beforehand.

    ``difference`` is the success minus that of the unchanged policy.
    """
    targets, seeing = targets_of(results), by_target(results[SEEING])
    tried = {name: (runs, "success", "score") for name, runs in results.items()}
    if built:
        tried[BUILT] = results[episodes.FROZEN], "built", "built_score"
    rows: dict[str, Row] = {}
    for name, (runs, ended, score) in tried.items():
        success = by_target(runs, ended)
        above = intervals.estimate(success - seeing, targets)
        rows[name] = Row(
            success=report.numbers(intervals.estimate(success, targets)),
            score=float(np.mean([getattr(each, score) for run in runs for each in run])),
            figures={"difference": report.numbers(above)},
        )
    return rows


def best_speed(rows: Mapping[str, Row]) -> str:
    """Return the best fixed speed, by success, then score."""
    fixed = [name for name in rows if name.endswith(" m/s")]
    return max(fixed, key=lambda name: (rows[name].success[0], rows[name].score or 0.0))


def show(name: str, rows: Mapping[str, Row], count: int) -> table.Table:
    """Return the table of results; `count` is the number of episodes in each row."""
    lines: list[dict[str, str]] = []
    for each, row in rows.items():
        success, above = (
            intervals.Estimate(*map(np.asarray, values))
            for values in (row.success, row.figures["difference"])
        )
        points = "" if each == SEEING else above.points()
        cells = each, str(success), f"{row.score:.3f}", points
        columns = "", "success (95 %)", "score", f"points above {SEEING}"
        lines.append(dict(zip(columns, cells, strict=True)))
    shown = text_table(f"{name}, {count} episodes a row", lines)
    shown.caption_justify = "left"
    shown.caption = (
        f"Best of the speeds, chosen on these draws: {best_speed(rows)}. Where all "
        f"episodes end alike an interval has no width; Wilson's of {count} successes is "
        f"{intervals.percent(share(count, count).low)}–100 %."
    )
    return shown


def main(
    policy: Annotated[
        str,
        typer.Argument(
            help="A set of shipped policies, a policy (.safetensors), or "
            "NAME=PATH,PATH,... for the seeds of one method."
        ),
    ],
    seeds: Annotated[
        int | None, typer.Option(min=1, help="Number of training seeds; all by default.")
    ] = None,
    config: EnvConfig = "ppo-tube-feed",
    env: EnvChanges = None,
    draws: Annotated[int, typer.Option(min=1, help="Episodes per target.")] = 20,
    processes: Annotated[int, typer.Option(min=1, help="Number of parallel processes.")] = 2,
    output: Annotated[
        Path | None, typer.Option(help="Folder of the results; runs/ablation-POLICY by default.")
    ] = None,
) -> None:
    """Compare a trained policy with itself without some of its parts."""
    with reported_errors(ValueError):
        settings = env_settings(config, env or [])
        parsed = Method.parse(policy)
        method = Method(parsed.name, parsed.policies[:seeds])
        for each in method.policies:
            episodes.check(each, settings)
        folder = output or Path("runs") / f"ablation-{method.name}"
        episodes.warm_up(settings)
        rows = measure(method, settings, draws, processes, folder)
    own_seeds, best = tuple(evaluation_seeds(draws)), {"best speed": best_speed(rows)}
    results = report.made("ablation", settings, rows, seeds=own_seeds, figures=best)
    results.write(folder / "ablation.json")
    count = len(method.policies) * len(episodes.make_env(settings).targets) * draws
    options.show(show(method.name, rows, count))
    options.say_written(folder / "ablation.json")


if __name__ == "__main__":
    run_command(main)
