"""Loss of success on words excluded from training: ``python -m agents.generalise CONFIG``.

All fully folded words are divided into folds. For each fold, a policy is trained on the words of
the other folds; it then plays the held-out words of its fold and the seen words of the others.
Another method with separate choices for every word may play all words for comparison. An
interrupted command continues when it is called again.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from agents.commands import Assignments, reported_errors, run_command, text_table
from agents.evaluate import evaluate
from agents.evaluation import episodes, intervals, report
from agents.settings import EnvSettings, TrainSettings, env_settings, load_settings
from agents.training.folder import file_digest
from agents.training.run import train
from magfold_env.cli import options
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.shapes import folded_words, mirror

DIFFERENCES = ("lost", "ahead of it, held out")
"""Columns of the summary that are not rates."""
DEAL = 0
"""Seed of the division, which is equal for all methods at one length."""


@dataclass(frozen=True)
class Fold:
    """One fold and the results of its policy."""

    held: dict[str, float]
    """Rate of success by held-out word."""
    seen: dict[str, float]
    """Rate of success by seen word."""
    policy: str
    """SHA-256 of the policy's file."""


def deal(words: Sequence[str], folds: int) -> list[list[str]]:
    """Return the words of each fold, divided randomly with a fixed seed.

    A word and its mirror image stay together, because a symmetric device makes both alike.
    """
    pairs = sorted({tuple(sorted({word, mirror(word)} & set(words))) for word in words})
    order = np.random.default_rng(DEAL).permutation(len(pairs))
    return [[word for k in order[fold::folds] for word in pairs[int(k)]] for fold in range(folds)]


def settings_of(
    config: str, assignments: Sequence[str], components: int, held: Sequence[str], fold: int
) -> TrainSettings:
    """Return the training on all words except the held-out ones."""
    seen = [word for word in folded_words(components) if word not in held]
    own = [f"env.components={components}", f"env.targets=[{', '.join(seen)}]"]
    return load_settings(config, [*assignments, *own], seed=fold)


def play(
    policy: str,
    env: EnvSettings,
    words: Sequence[str],
    draws: int,
    processes: int,
    folder: Path | None = None,
) -> dict[str, float]:
    """Return the rate of success of a policy on each of some words."""
    env = env.model_copy(update={"targets": tuple(words)})
    method = episodes.Method("policy", (policy,))
    runs = evaluate([method], env, draws, processes, folder=folder)["policy"]
    return dict(zip(words, report.by_target(runs)[0].tolist(), strict=True))


def measure(
    settings: Sequence[TrainSettings],
    env: EnvSettings,
    folds: Sequence[Sequence[str]],
    draws: tuple[int, int],
    folder: Path,
    processes: int = 1,
) -> list[Fold]:
    """Train a policy for each fold and let it play all words in `env`.

    `folds` contains the words of each fold, `settings` its training, and `draws` the numbers of
    episodes per held-out word and per seen word. `folder` contains the training runs, ``fold-0``
    and so on, and the played episodes.
    """
    found: list[Fold] = []
    words = [word for fold in folds for word in fold]
    for k, (held, each) in enumerate(zip(folds, settings, strict=True)):
        policy = str(train(each, folder / f"fold-{k}"))
        seen = [word for word in words if word not in held]
        rates = [
            play(policy, env, some, count, processes, folder / f"{name}-{k}")
            for name, some, count in zip(("held", "seen"), (held, seen), draws, strict=True)
        ]
        found.append(Fold(*rates, policy=str(file_digest(policy))))
    return found


def summary(
    found: Sequence[Fold], other: dict[str, float] | None = None
) -> dict[str, intervals.Estimate]:
    """Return the summary of the folds; intervals are from the bootstrap over words.

    Each word is held out once and seen by the policies of all other folds, which are averaged.
    """
    words = [word for fold in found for word in fold.held]
    held = np.array([[rate for fold in found for rate in fold.held.values()]])
    often = [[fold.seen[word] for fold in found if word in fold.seen] for word in words]
    seen = np.array([[sum(rates) / len(rates) for rates in often]])
    rows = {
        "held out": intervals.estimate(held, words),
        "seen": intervals.estimate(seen, words),
        "lost": intervals.difference(seen, held, words),
    }
    if other is not None:
        beside = np.array([[other[word] for word in words]])
        rows["other"] = intervals.estimate(beside, words)
        rows["ahead of it, held out"] = intervals.difference(held, beside, words)
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
    processes: Annotated[int, typer.Option(min=1, help="Episodes at a time.")] = 2,
    output: Annotated[
        Path | None, typer.Option(help="Folder; runs/generalise-COMPONENTS by default.")
    ] = None,
) -> None:
    """Train on all fully folded words except some, and play these."""
    folder = output or Path("runs") / f"generalise-{components}"
    with reported_errors(ValueError):
        dealt = deal(list(folded_words(components)), folds)
        settings = [
            settings_of(config, assignments or (), components, held, fold)
            for fold, held in enumerate(dealt)
        ]
        own = [each[4:] for each in assignments or () if each.startswith("env.")]
        places = env_settings(config, [*own, f"components={components}"])
        words = [word for held in dealt for word in held]
        if against is not None:
            episodes.check(against, places.model_copy(update={"targets": tuple(words)}))
        found = measure(settings, places, dealt, (draws, -(-draws // 4)), folder, processes)
        other = None
        if against is not None:
            other = play(against, places, words, draws, processes)
    rows = summary(found, other)
    shown = [
        {"": name, "success (95 %)": each.points(" points") if name in DIFFERENCES else str(each)}
        for name, each in rows.items()
    ]
    options.show(text_table(f"Words held out, {folds} folds", shown))
    told = {name: report.numbers(each) for name, each in rows.items()}
    kept = {name: report.Row(success=told[name]) for name in told if name not in DIFFERENCES}
    figures = {name: told[name] for name in DIFFERENCES if name in told}
    figures |= {"folds": [asdict(fold) for fold in found], "other": other}
    seeds = tuple(evaluation_seeds(draws))
    made = report.made("generalisation", places, kept, seeds=seeds, figures=figures)
    made.write(folder / "generalise.json")
    options.say_written(folder / "generalise.json")


if __name__ == "__main__":
    run_command(main)
