"""Which folds are shown, and the pages that play them."""

from collections.abc import Sequence
from typing import NamedTuple

from agents.evaluation.episodes import Outcome
from agents.evaluation.methods import Results, Runs, targets_of
from magfold_env.fold import Fold, recording
from magfold_env.replay import page, page_data
from magfold_env.simulation.simulate import simulate

FRAME_RATE = 120.0
"""Recorded frames per simulated second [1/s]."""


class Replay(NamedTuple):
    """A fold that is shown."""

    outcome: Outcome
    page: str
    """A page that plays it, whole in itself."""


def replays(results: Results, count: int) -> dict[str, list[Replay]]:
    """Return the same episodes of every method, as pages, and a miss of each if there is one.

    They are the first draw of `count` targets, evenly picked, by a method's first run: nothing is
    selected by its outcome. Where none of these missed, the first episode that did is added.

    Parameters
    ----------
    results : mapping
        The runs of each method.
    count : int
        How many targets.
    """
    words = spread(targets_of(results), count)
    return {
        name: [
            Replay(outcome, page(page_data(recording(fold))))
            for outcome in _shown(runs, words)
            if (fold := recorded(outcome)) is not None
        ]
        for name, runs in results.items()
    }


def recorded(outcome: Outcome) -> Fold | None:
    """Return an episode simulated once more, with its motion; None if it cannot be."""
    return None if outcome.scene is None else simulate(outcome.scene, frame_rate=FRAME_RATE)


def spread(words: Sequence[str], count: int) -> list[str]:
    """Return `count` words, evenly picked; all if there are no more."""
    return list(words[:: max(1, len(words) // count)][:count])


def firsts(outcomes: Sequence[Outcome], words: Sequence[str]) -> list[Outcome]:
    """Return the first episode of each of `words` that can be replayed."""
    found: dict[str, Outcome] = {}
    for outcome in outcomes:
        if outcome.scene is not None:
            found.setdefault(outcome.target, outcome)
    return [found[word] for word in words if word in found]


def _shown(runs: Runs, words: Sequence[str]) -> list[Outcome]:
    shown = firsts(runs[0], words)
    missed = [each for each in runs[0] if not each.success and each.scene is not None]
    if missed and all(each.success for each in shown):
        shown.append(missed[0])
    return shown
