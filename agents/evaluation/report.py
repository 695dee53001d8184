"""Comparison of methods: what follows from the outcomes, a table, JSON for later."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from agents.evaluation.episodes import Outcome
from agents.evaluation.intervals import Estimate, difference, estimate, interquartile_mean, percent
from agents.evaluation.methods import Method, Results, by_target, pooled, targets_of
from agents.evaluation.provenance import file_digest, provenance
from agents.evaluation.reasons import ends, joints_in_the_way
from agents.settings.run import EnvSettings
from magfold_env.files import write_text
from magfold_env.reporting.statistics import Share, share

FORMAT = "magfold_env evaluation 2"

REFERENCE = "minimiser"
"""The method that others are compared with, pair by pair."""


@dataclass(frozen=True)
class Summary:
    """What the runs of one method come to.

    Attributes
    ----------
    success, iqm : Estimate
        Mean and interquartile mean of the rate of success over runs and targets.
    score, reward : Estimate
        Means of the score and of the return.
    built : Estimate or None
        Rate of success of the same choices when the chain is built beforehand; None if that was
        not tried.
    ahead : Estimate or None
        Success above that of `REFERENCE` on the same targets; None without it, or for itself.
    targets : dict of Share
        By target, all runs together, with Wilson's intervals.
    ends : dict of int
        How many episodes came to each end.
    joints : dict of list of int
        How often each joint stayed open, or folded to the wrong side, in episodes that missed.
    """

    success: Estimate
    iqm: Estimate
    score: Estimate
    reward: Estimate
    built: Estimate | None
    ahead: Estimate | None
    targets: dict[str, Share]
    ends: dict[str, int]
    joints: dict[str, list[int]]


def summarise(results: Results) -> dict[str, Summary]:
    """Return what the outcomes of each method come to."""
    targets = targets_of(results)
    reference = by_target(results[REFERENCE]) if REFERENCE in results else None
    found: dict[str, Summary] = {}
    for name, runs in results.items():
        success = by_target(runs)
        tried = pooled(runs)[0].built is not None
        other = None if name == REFERENCE else reference
        found[name] = Summary(
            success=estimate(success, targets),
            iqm=estimate(success, targets, interquartile_mean),
            score=estimate(by_target(runs, "score"), targets),
            reward=estimate(by_target(runs, "reward"), targets),
            built=estimate(by_target(runs, "built"), targets) if tried else None,
            ahead=None if other is None else difference(success, other, targets),
            targets={target: _share(pooled(runs, target)) for target in targets},
            ends=ends(pooled(runs)),
            joints=joints_in_the_way(pooled(runs)),
        )
    return found


def overall_table(summaries: Mapping[str, Summary]) -> Table:
    """Return a table of what is said of each method as a whole, a row a method."""
    rows = {
        name: [cell.replace(" (", "\n(") for cell in cells]
        for name, cells in overall_rows(list(summaries.values())).items()
    }
    table = Table(title="In all", box=SIMPLE_HEAD, padding=(0, 1, 1, 0), show_edge=False)
    table.add_column("", overflow="fold")
    for name, cells in rows.items():
        # Headings may be broken, cells not.
        width = max(len(line) for cell in cells for line in cell.splitlines())
        table.add_column(name, justify="right", min_width=width)
    for k, name in enumerate(summaries):
        table.add_row(name, *(cells[k] for cells in rows.values()))
    return table


def targets_table(summaries: Mapping[str, Summary]) -> Table:
    """Return a table of successes with a row for each target and a column for each method."""
    table = Table(title="Success by target")
    table.add_column("target")
    for name in summaries:
        table.add_column(name, justify="right")
    each = list(summaries.values())
    for target in each[0].targets:
        shares = [summary.targets[target] for summary in each]
        table.add_row(target, *(f"{s.successes}/{s.trials}" for s in shares))
    return table


def overall_rows(summaries: Sequence[Summary]) -> dict[str, list[str]]:
    """Return what is said of each method as a whole: a name, and a text for each method."""
    rows = {
        "success": [str(each.success) for each in summaries],
        "middle half": [str(each.iqm) for each in summaries],
        f"above the {REFERENCE}": [_points(each.ahead) for each in summaries],
        "built beforehand": ["–" if each.built is None else str(each.built) for each in summaries],
        "score": [f"{each.score.value:.3f}" for each in summaries],
        "return": [f"{each.reward.value:+.3f}".replace("-", "−") for each in summaries],
    }
    return {name: cells for name, cells in rows.items() if set(cells) != {"–"}}


def write_results(
    path: Path,
    settings: EnvSettings,
    methods: Sequence[Method],
    seeds: Sequence[int],
    results: Results,
    summaries: Mapping[str, Summary],
) -> None:
    """Write everything that was measured, and what repeats it, to `path` as JSON."""
    content: dict[str, Any] = {
        "format": FORMAT,
        "env": settings.model_dump(mode="json"),
        "confidence": 0.95,
        "seeds": list(seeds),
        "provenance": provenance(),
        "methods": {
            method.name: {
                "policies": [
                    {"policy": policy, "sha256": file_digest(policy)} for policy in method.policies
                ],
                "summary": _plain(summaries[method.name]),
                "runs": [[_episode(each) for each in run] for run in results[method.name]],
            }
            for method in methods
        },
    }
    write_text(path, json.dumps(content) + "\n")


def _plain(summary: Summary) -> dict[str, Any]:
    """Return a summary as values that JSON can hold."""
    values = {
        name: {key: float(part) for key, part in value._asdict().items()}
        if isinstance(value, Estimate)
        else value
        for name, value in vars(summary).items()
    }
    shares = {word: {"rate": each.rate, **asdict(each)} for word, each in summary.targets.items()}
    return values | {"targets": shares}


def _episode(outcome: Outcome) -> dict[str, Any]:
    """Return an episode as plain values; magnets and drawn speeds stand for its scene."""
    values = {key: value for key, value in vars(outcome).items() if key not in ("scene", "choice")}
    if outcome.choice is not None:
        values |= outcome.choice._asdict()
    if outcome.scene is not None:
        values["drawn_speeds"] = outcome.scene.speeds.tolist()
    return values


def _share(outcomes: Sequence[Outcome]) -> Share:
    return share(int(np.sum([each.success for each in outcomes])), len(outcomes))


def _points(found: Estimate | None) -> str:
    """Return a difference of shares and its interval, in points of per cent."""
    if found is None:
        return "–"
    value, low, high = (percent(float(each), "+") for each in found)
    return f"{value} ({low}…{high})"
