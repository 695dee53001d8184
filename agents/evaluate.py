"""Compare policies on fixed draws: ``python -m agents.evaluate [NAME=PATH,PATH,... ...]``."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from agents.commands import (
    Draws,
    EnvChanges,
    EnvConfig,
    Processes,
    progress_bar,
    run_command,
    text_table,
)
from agents.evaluation import episodes, page, report
from agents.settings import EnvSettings, env_settings
from magfold_env.cli import options
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.files import physics_digest


def evaluate(
    methods: Sequence[episodes.Method],
    settings: EnvSettings,
    draws: int,
    processes: int = 2,
    folder: Path | None = None,
) -> report.Played:
    """Play every policy on every target with the same draws, which training never uses.

    Each policy plays `draws` episodes on each target, in `processes` processes. The result maps
    each method's name to its runs. Episodes that `folder` contains are not played again, and are
    returned without their choices and scenes.
    """
    seeds = evaluation_seeds(draws)
    wanted = [(target, seed) for target in episodes.make_env(settings).targets for seed in seeds]
    key = {"env": settings.model_dump(mode="json"), "physics": physics_digest()}
    with progress_bar() as bar:
        table = episodes.Table(bar, processes, folder, key)
        return {
            each.name: [
                episodes.play_all(table, each, policy, settings, wanted) for policy in each.policies
            ]
            for each in methods
        }


def compare(
    methods: Sequence[episodes.Method],
    settings: EnvSettings,
    draws: int,
    processes: int,
    folder: Path,
    built: bool = False,
) -> report.Played:
    """Evaluate methods, print tables of the results, and write JSON and a page to `folder`.

    The comparison includes random actions and, if every target has one, the energy minimiser's
    designs. The given methods come first. If `built`, each chosen chain is also built
    beforehand and then folded. The other arguments are those of `evaluate`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    typer.echo(page.conditions(settings, draws))
    env = episodes.make_env(settings)
    usual = [report.RANDOM]
    if missing := [target for target in env.targets if env.baseline_of(target).flagged]:
        typer.echo(f"the minimiser has no design for {', '.join(missing)} and is left out")
    else:
        usual.append(report.REFERENCE)
    taken = {method.name for method in methods}
    every = [*methods, *(episodes.Method(name, (name,)) for name in usual if name not in taken)]
    every = [replace(method, built=built) for method in every]
    results = evaluate(every, settings, draws, processes)
    summaries = report.summarise(results)
    options.show(
        text_table("Success by target", report.targets_rows(summaries)),
        text_table("Overall", report.overall_rows(summaries)),
    )
    seeds = evaluation_seeds(draws)
    report.results_of(settings, every, seeds, results, summaries).write(folder / "results.json")
    page.write_page(folder / "report.html", settings, draws, results, summaries)
    options.say_written(folder / "results.json", folder / "report.html")
    return results


def main(
    agents: Annotated[
        list[str] | None,
        typer.Argument(
            help="Policies (.safetensors) or choices of agents.baselines (.json); "
            "NAME=PATH,PATH,... with a path per training seed."
        ),
    ] = None,
    config: EnvConfig = "ppo-tube-feed",
    env: EnvChanges = None,
    draws: Draws = 20,
    processes: Processes = 2,
    built: Annotated[
        bool, typer.Option(help="Also fold every choice as a chain built beforehand (preloaded).")
    ] = True,
    output: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("runs/evaluation"),
) -> None:
    """Compare random actions, the energy minimiser's designs, searches and trained policies."""
    options.check_folder("--output", output)
    settings = env_settings(config, env or [])
    methods = episodes.parse_methods(agents or [])
    for policy in (each for method in methods for each in method.policies):
        episodes.check(policy, settings)
    episodes.warm_up(settings)
    compare(methods, settings, draws, processes, output, built)


if __name__ == "__main__":
    run_command(main)
