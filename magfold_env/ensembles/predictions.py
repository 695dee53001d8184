"""The words that energy minimisation predicts."""

from __future__ import annotations

from contextlib import suppress

from magfold_env.minimiser import Mode, minimise
from magfold_env.scene import Scene

PREDICTORS: dict[Mode, str] = {
    "free": "full search",
    "forward": "forward search",
    "backward": "backward search",
}
"""Names of the minimiser's searches, by its mode."""


def predictions(scene: Scene) -> dict[str, str]:
    """Return the word that each of the minimiser's searches ends in, by the search's name.

    Searches that refuse the scene, or shut themselves in, are left out.
    """
    found: dict[str, str] = {}
    for mode, name in PREDICTORS.items():
        with suppress(ValueError):
            found[name] = minimise(scene, mode, top=1).best.word
    return found
