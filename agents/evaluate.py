"""Compare policies on fixed draws: ``python -m agents.evaluate [CHECKPOINT ...]``."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from agents.callbacks import progress_bar
from agents.episodes import Outcome, make_env, play_all
from agents.gif import save_folds
from agents.report import results_table, write_results
from agents.settings import EnvSettings, load_settings
from magfold_env.envs.draws import evaluation_seeds


def evaluate(
    policies: Sequence[str], settings: EnvSettings, draws: int, processes: int = 2
) -> dict[str, list[Outcome]]:
    """Play every policy on every target with the same draws, none of which training sees.

    Parameters
    ----------
    policies : sequence of str
        ``random``, ``minimiser``, or paths of checkpoints.
    settings : EnvSettings
        The environment.
    draws : int
        Episodes per target.
    processes : int
        How many episodes to play at a time.

    Returns
    -------
    dict
        The outcomes of each policy, by its name.
    """
    seeds = evaluation_seeds(draws)
    episodes = [(target, seed) for target in make_env(settings).targets for seed in seeds]
    results: dict[str, list[Outcome]] = {}
    with progress_bar() as bar:
        for policy in policies:
            task = bar.add_task(policy, total=len(episodes), note="")
            results[policy] = []
            for outcome in play_all(policy, settings, episodes, processes):
                results[policy].append(outcome)
                successes = sum(o.success for o in results[policy])
                note = f"success {100 * successes / len(results[policy]):.0f} %"
                bar.update(task, advance=1, note=note)
    return results


def compare(
    checkpoints: Sequence[Path], settings: EnvSettings, draws: int, processes: int, folder: Path
) -> dict[str, list[Outcome]]:
    """Evaluate, show the table, and write ``results.json`` and ``folds.gif`` to `folder`.

    The minimiser is left out where it has no design for one of the targets.
    """
    console = Console()
    folder.mkdir(parents=True, exist_ok=True)
    env = make_env(settings)
    policies = ["random", *map(str, checkpoints)]
    missing = [target for target in env.targets if env.baseline_of(target).flagged]
    if missing:
        console.print(f"the minimiser has no design for {', '.join(missing)} and is left out")
    else:
        policies.insert(1, "minimiser")
    results = evaluate(policies, settings, draws, processes)
    console.print(results_table(results))
    write_results(folder / "results.json", settings, results)
    save_folds(folder / "folds.gif", results, policies[-1])
    console.print(f"written: {folder / 'results.json'}, {folder / 'folds.gif'}")
    return results


def main(
    checkpoints: Annotated[
        list[Path] | None, typer.Argument(help="Trained policies; load only your own.")
    ] = None,
    config: Annotated[
        str, typer.Option(help="Training settings that give the environment.")
    ] = "ppo-tube-feed",
    draws: Annotated[int, typer.Option(min=1, help="Episodes per target.")] = 20,
    processes: Annotated[int, typer.Option(min=1, help="Episodes played at a time.")] = 2,
    output: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("runs/evaluation"),
) -> None:
    """Compare random actions, the energy minimiser's designs and trained policies."""
    console = Console(stderr=True)
    try:
        settings = load_settings(config).env
        for checkpoint in checkpoints or []:
            if not checkpoint.is_file():
                raise ValueError(f"{checkpoint}: no such file; must be a checkpoint (.zip)")
        make_env(settings)
    except ValueError as error:
        console.print(f"[red]error:[/red] {error}", highlight=False)
        raise typer.Exit(1) from None
    compare(checkpoints or [], settings, draws, processes, output)


if __name__ == "__main__":
    typer.run(main)
