"""Loss of success on words excluded from training: ``python -m agents.generalise CONFIG``.

All fully folded words are divided into the folds of a cross-validation. For each fold, a policy is
trained on the words of the other folds; it then plays the held-out words of its own fold and the
words of the others, which it has seen. For comparison, another method with separate choices for
every word may play all words. If it is called again, the command continues an interrupted run.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from agents.commands import Assignments, Processes, run_command, text_table
from agents.evaluate import evaluate
from agents.evaluation import episodes, intervals, report
from agents.settings import EnvSettings, env_settings, load_settings
from agents.training.folder import file_digest
from agents.training.run import train
from magfold_env.cli import options
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.scoring.results import Row
from magfold_env.shapes import folded_words, mirror

DIFFERENCES = ("lost", "ahead of it, held out")
"""Rows of the summary that are differences, not rates."""
DEAL = 0
"""Seed of the division into folds, which is the same for all methods at a given length."""


def deal(words: Sequence[str], folds: int) -> list[list[str]]:
    """Return the words of each fold, divided randomly with a fixed seed.

    A word and its mirror image stay together, because a symmetric device folds both equally well.
    """
    pairs = sorted({tuple(sorted({word, mirror(word)} & set(words))) for word in words})
    order = np.random.default_rng(DEAL).permutation(len(pairs))
    return [[word for k in order[fold::folds] for word in pairs[int(k)]] for fold in range(folds)]


def play(
    policy: str,
    env: EnvSettings,
    words: Sequence[str],
    draws: int,
    processes: int,
    folder: Path | None = None,
) -> dict[str, float]:
    """Return a policy's success rate on each word."""
    env = env.model_copy(update={"targets": tuple(words)})
    method = episodes.Method("policy", (policy,))
    runs = evaluate([method], env, draws, processes, folder=folder)["policy"]
    return dict(zip(words, report.by_target(runs)[0].tolist(), strict=True))


def summary(
    held: Mapping[str, float],
    seen: Sequence[Mapping[str, float]],
    other: Mapping[str, float] | None = None,
) -> dict[str, intervals.Estimate]:
    """Return mean success rates and their differences; intervals are bootstrapped over words.

    Each word is held out once. The policies of all other folds have seen it; their rates are
    averaged.
    """
    words = list(held)
    rates = np.array([list(held.values())])
    often = [[each[word] for each in seen if word in each] for word in words]
    again = np.array([[sum(each) / len(each) for each in often]])
    rows = {
        "held out": intervals.estimate(rates, words),
        "seen": intervals.estimate(again, words),
        "lost": intervals.difference(again, rates, words),
    }
    if other is not None:
        beside = np.array([[other[word] for word in words]])
        rows["other"] = intervals.estimate(beside, words)
        rows["ahead of it, held out"] = intervals.difference(rates, beside, words)
    return rows


def main(
    config: Annotated[str, typer.Argument(help="Training settings.")] = "ppo-floor-8",
    components: Annotated[int, typer.Option(min=2, help="Length of the chain.")] = 8,
    folds: Annotated[int, typer.Option(min=2, help="Number of folds.")] = 5,
    draws: Annotated[
        int,
        typer.Option(
            min=1,
            help="Episodes per held-out word; each policy plays a quarter as many per seen word.",
        ),
    ] = 20,
    against: Annotated[
        str | None,
        typer.Option(help="Choices of agents.baselines (.json) for all words, for comparison."),
    ] = None,
    assignments: Assignments = None,
    processes: Processes = 2,
    output: Annotated[
        Path | None, typer.Option(help="Folder; runs/generalise-COMPONENTS by default.")
    ] = None,
) -> None:
    """Train with some fully folded words held out, then play the held-out words."""
    folder = output or Path("runs") / f"generalise-{components}"
    options.check_folder("--output", folder)
    held_out: list[dict[str, float]] = []
    seen: list[dict[str, float]] = []
    policies: list[Any] = []
    other = None
    dealt = deal(list(folded_words(components)), folds)
    words = [word for held in dealt for word in held]
    length = f"components={components}"
    own = [each[4:] for each in assignments or () if each.startswith("env.")]
    env = env_settings(config, [*own, length])
    if against is not None:
        episodes.check(against, env.model_copy(update={"targets": tuple(words)}))
    for k, held in enumerate(dealt):
        others = [word for word in words if word not in held]
        targets = ", ".join(sorted(others))
        changes = [*(assignments or ()), f"env.{length}", f"env.targets=[{targets}]"]
        settings = load_settings(config, changes, seed=k)
        policy = str(train(settings, folder / f"fold-{k}"))
        policies.append(file_digest(policy))
        held_out.append(play(policy, env, held, draws, processes, folder / f"held-{k}"))
        seen.append(play(policy, env, others, -(-draws // 4), processes, folder / f"seen-{k}"))
    if against is not None:
        other = play(against, env, words, draws, processes)
    rows = summary({word: rate for each in held_out for word, rate in each.items()}, seen, other)
    shown = [
        {"": name, "success (95 %)": each.points(" points") if name in DIFFERENCES else str(each)}
        for name, each in rows.items()
    ]
    options.show(text_table(f"Held-out words, {folds} folds", shown))
    parts = zip(held_out, seen, policies, strict=True)
    figures: dict[str, Any] = {name: rows[name] for name in DIFFERENCES if name in rows}
    figures["folds"] = [dict(zip(("held", "seen", "policy"), each, strict=True)) for each in parts]
    results = report.made(
        "generalisation",
        env.id,
        {name: Row(success=each) for name, each in rows.items() if name not in DIFFERENCES},
        env=report.own_settings(env),
        seeds=tuple(evaluation_seeds(draws)),
        figures=figures | {"other": other},
    )
    results.write(folder / "generalise.json")
    options.say_written(folder / "generalise.json")


if __name__ == "__main__":
    run_command(main)
