"""Comparison of policies: a table for the screen, JSON for later."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from agents.episodes import Outcome
from agents.settings import EnvSettings
from magfold_env.files import write_text
from magfold_env.statistics import Share, share

Results = Mapping[str, Sequence[Outcome]]
"""The outcomes of every policy, by its name."""


def results_table(results: Results) -> Table:
    """Return a table with a row for each target and a column for each policy."""
    table = Table(title="Success by target", show_footer=False)
    table.add_column("target")
    for name in results:
        table.add_column(name, justify="right")
    for target in _targets(results):
        shares = [_share(_of(outcomes, target)) for outcomes in results.values()]
        table.add_row(target, *(f"{s.successes}/{s.trials}" for s in shares))
    table.add_section()
    table.add_row("overall, 95 %", *(str(_share(outcomes)) for outcomes in results.values()))
    table.add_row("mean score", *(f"{_mean_score(outcomes):.3f}" for outcomes in results.values()))
    table.add_row("mean reward", *(f"{_mean_reward(o):+.3f}" for o in results.values()))
    return table


def write_results(path: Path, settings: EnvSettings, results: Results) -> None:
    """Write everything that was measured to `path` as JSON."""
    content: dict[str, Any] = {
        "env": settings.model_dump(mode="json"),
        "confidence": 0.95,
        "policies": {name: _summary(outcomes) for name, outcomes in results.items()},
    }
    write_text(path, json.dumps(content, indent=1) + "\n")


def _summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return one policy's results as plain values."""
    targets = _targets({"": outcomes})
    return {
        "success": _share_values(_share(outcomes)),
        "mean_score": _mean_score(outcomes),
        "mean_reward": _mean_reward(outcomes),
        "targets": {target: _share_values(_share(_of(outcomes, target))) for target in targets},
        "episodes": [_plain(outcome) for outcome in outcomes],
    }


def _plain(outcome: Outcome) -> dict[str, Any]:
    """Return an episode as plain values; its magnets and speeds stand for the scene."""
    values = {key: value for key, value in vars(outcome).items() if key != "scene"}
    if outcome.scene is not None:
        values["sequence"] = list(outcome.scene.sequence)
        values["speeds"] = outcome.scene.speeds.tolist()
    return values


def _share_values(result: Share) -> dict[str, float]:
    return {"rate": result.rate, **asdict(result)}


def _share(outcomes: Iterable[Outcome]) -> Share:
    successes = [outcome.success for outcome in outcomes]
    return share(sum(successes), len(successes))


def _mean_score(outcomes: Iterable[Outcome]) -> float:
    return float(np.mean([outcome.score for outcome in outcomes]))


def _mean_reward(outcomes: Iterable[Outcome]) -> float:
    return float(np.mean([outcome.reward for outcome in outcomes]))


def _of(outcomes: Iterable[Outcome], target: str) -> list[Outcome]:
    return [outcome for outcome in outcomes if outcome.target == target]


def _targets(results: Results) -> list[str]:
    """Return the targets in the order in which they were first played."""
    words = (outcome.target for outcomes in results.values() for outcome in outcomes)
    return list(dict.fromkeys(words))
