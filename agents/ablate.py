"""Ablation of a trained policy: ``python -m agents.ablate POLICY``.

The policy plays ``TubeFeed``, both unchanged and with parts of the policy removed, as
``docs/evaluation.md`` describes. All these players have the same targets and draws. Intervals are
95 % bootstrap intervals over training seeds and targets together; intervals of differences are
paired by seed, target and draws.
If it is called again, the command continues an interrupted run or prints a finished table.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from agents.commands import (
    Draws,
    EnvChanges,
    EnvConfig,
    Processes,
    run_command,
    text_table,
)
from agents.evaluate import evaluate
from agents.evaluation import episodes, intervals, report
from agents.evaluation.episodes import FROZEN, NO_MOTION, RANDOM_SPEEDS, Change, Method
from agents.settings import EnvSettings, env_settings
from magfold_env.cli import options
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.reporting.intervals import share
from magfold_env.scoring.results import Row

SEEING, BUILT = "seeing", "built beforehand"


def measure(
    method: Method, settings: EnvSettings, draws: int, processes: int, folder: Path
) -> dict[str, Row]:
    """Play every ablation with the same targets and draws, and return a row for each.

    Training never uses these draws. Episodes are stored in `folder`, and stored episodes are not
    played again. `processes` is the number of parallel processes.

    Raises
    ------
    ValueError
        If actions choose whole chains, without observations in between; if `folder` contains other
        episodes; or if a policy cannot play these episodes.
    """
    env = episodes.make_env(settings)
    if env.actions.components > 1:
        raise ValueError(
            f"env.id: {settings.id!r} is not allowed; must be MagFold/TubeFeed-v0 or "
            "MagFold/TubeFeedGoal-v0, where a policy can observe what its choices do"
        )
    changes: dict[str, Change] = {SEEING: None, NO_MOTION: NO_MOTION, FROZEN: FROZEN}
    changes |= {f"{speed:.3f} m/s": speed for speed in env.actions.speeds.tolist()}
    changes[RANDOM_SPEEDS] = RANDOM_SPEEDS
    dynamics = env.task.fidelity == "dynamics"
    methods = [
        Method(name, method.policies, change, dynamics and change == FROZEN)
        for name, change in changes.items()
    ]
    results = evaluate(methods, settings, draws, processes, folder=folder / "episodes")
    files = report.files_of(method.policies)
    return {
        name: row.model_copy(update={"files": files})
        for name, row in summarise(results, dynamics).items()
    }


def summarise(results: report.Played, built: bool = False) -> dict[str, Row]:
    """Return a row of results per ablation.

    If `built`, a further row is for the chains of the ablation ``frozen``, built beforehand.
    ``difference`` is the success rate minus the unchanged policy's success rate.
    """
    targets, seeing = report.targets_of(results), report.by_target(results[SEEING])
    tried = {name: (runs, "success", "score") for name, runs in results.items()}
    if built:
        tried[BUILT] = results[FROZEN], "built", "built_score"
    rows: dict[str, Row] = {}
    for name, (runs, ended, score) in tried.items():
        success = report.by_target(runs, ended)
        rows[name] = Row(
            success=intervals.estimate(success, targets),
            score=float(np.mean([getattr(each, score) for run in runs for each in run])),
            figures={"difference": intervals.estimate(success - seeing, targets)},
        )
    return rows


def main(
    policy: Annotated[
        str,
        typer.Argument(
            help="A set of shipped policies, a policy (.safetensors), or "
            "NAME=PATH,PATH,... with a path per training seed."
        ),
    ],
    seeds: Annotated[
        int | None, typer.Option(min=1, help="Number of training seeds; all by default.")
    ] = None,
    config: EnvConfig = "ppo-tube-feed",
    env: EnvChanges = None,
    draws: Draws = 20,
    processes: Processes = 2,
    output: Annotated[
        Path | None, typer.Option(help="Folder of the results; runs/ablation-POLICY by default.")
    ] = None,
) -> None:
    """Compare a trained policy with ablations of itself."""
    settings = env_settings(config, env or [])
    parsed = Method.parse(policy)
    method = Method(parsed.name, parsed.policies[:seeds])
    for each in method.policies:
        episodes.check(each, settings)
    folder = output or Path("runs") / f"ablation-{method.name}"
    options.check_folder("--output", folder)
    episodes.warm_up(settings)
    rows = measure(method, settings, draws, processes, folder)
    speeds = [name for name in rows if name.endswith(" m/s")]
    best = max(speeds, key=lambda name: (rows[name].success[0], rows[name].score or 0.0))
    results = report.made(
        "ablation", settings.id, rows, env=report.own_settings(settings),
        seeds=tuple(evaluation_seeds(draws)), figures={"best speed": best},
    )  # fmt: skip
    results.write(folder / "ablation.json")
    lines = [
        {
            "": name,
            "success (95 %)": str(intervals.Estimate(*row.success)),
            "score": f"{row.score:.3f}",
            f"points above {SEEING}": ""
            if name == SEEING
            else intervals.Estimate(*row.figures["difference"]).points(),
        }
        for name, row in rows.items()
    ]
    count = len(method.policies) * len(episodes.make_env(settings).targets) * draws
    shown = text_table(f"{method.name}, {count} episodes per row", lines)
    shown.caption_justify = "left"
    shown.caption = (
        f"Best speed, chosen on these draws: {best}. Where all episodes end alike, the "
        f"interval has no width; Wilson's interval for {count} successes is "
        f"{intervals.percent(share(count, count).low)}–100 %."
    )
    options.show(shown)
    options.say_written(folder / "ablation.json")


if __name__ == "__main__":
    run_command(main)
