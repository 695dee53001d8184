"""A GIF of what policies fold."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from agents.episodes import Outcome
from magfold_env.render import save_gif
from magfold_env.simulate import simulate

FRAME_RATE = 120.0
"""Recorded frames per simulated second [1/s]."""


def save_folds(
    path: Path, results: Mapping[str, Sequence[Outcome]], policy: str, count: int = 6
) -> None:
    """Write a GIF of the first episode of `count` targets, evenly picked, played by `policy`.

    Nothing is selected by its outcome: failures show as they come.

    Parameters
    ----------
    path : Path
        Where to.
    results : mapping
        Outcomes by policy.
    policy : str
        Whose folds to show.
    count : int
        Most folds to show.
    """
    first: dict[str, Outcome] = {}
    for outcome in results[policy]:
        if outcome.scene is not None:
            first.setdefault(outcome.target, outcome)
    outcomes = list(first.values())
    shown = outcomes[:: max(1, len(outcomes) // count)][:count]
    folds = [
        simulate(outcome.scene, frame_rate=FRAME_RATE)
        for outcome in shown
        if outcome.scene is not None
    ]
    save_gif(folds, path, targets=[outcome.target for outcome in shown], size=(960, 640))
