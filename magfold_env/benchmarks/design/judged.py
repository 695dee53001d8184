"""The judgement of a design whose search was timed alone."""

from __future__ import annotations

from magfold_env.designer import Design
from magfold_env.ensembles import ensemble


def judged(design: Design, runs: int) -> float:
    """Return the share of successes on releases unknown to the search; 0 without a design."""
    if design.scene is None:
        return 0.0
    made = ensemble(design.scene, runs, design.releases_seed)
    return made.probability(design.target, "folded").rate
