"""A GIF of what a policy folds."""

from collections.abc import Sequence
from pathlib import Path

from agents.evaluation.episodes import Outcome
from agents.evaluation.replays import firsts, recorded, spread
from magfold_env.render import save_gif


def save_folds(path: Path, outcomes: Sequence[Outcome], count: int = 6) -> None:
    """Write a GIF of the first episode of `count` targets, evenly picked.

    Nothing is selected by its outcome: failures show as they come.

    Parameters
    ----------
    path : Path
        Where to.
    outcomes : sequence of Outcome
        Those of one run.
    count : int
        Most folds to show.
    """
    words = list(dict.fromkeys(each.target for each in outcomes if each.scene is not None))
    shown = firsts(outcomes, spread(words, count))
    folds = [fold for outcome in shown if (fold := recorded(outcome)) is not None]
    save_gif(folds, path, targets=[outcome.target for outcome in shown], size=(960, 640))
