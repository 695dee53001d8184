"""Summaries, tables and JSON of the outcomes of compared methods.

A method is one policy, or the trained policies of several seeds.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.evaluation import episodes, intervals
from agents.settings import EnvSettings
from agents.training.folder import file_digest, provenance
from magfold_env.envs.tasks.draws import EVALUATION_VERSION
from magfold_env.files import physics_digest
from magfold_env.reporting.intervals import Share, share
from magfold_env.scoring.results import File, Results, Row, Run, View

RANDOM = "random"
REFERENCE = "minimiser"
"""The method with which each other method is compared."""
USUAL = (RANDOM, REFERENCE)
"""Methods that are always compared, if possible."""

Runs = Sequence[Sequence[episodes.Outcome]]
"""Outcomes of each run of a method; all runs have the same targets and draws."""

Played = Mapping[str, Runs]
"""The runs of methods, by name."""

ENDS = ("target", "other fold", "misfolded", "unsettled", "failed")
"""How episodes end: in the target, at rest in another fold, at rest without being fully
folded, still moving at the time limit or the step limit, or with a failed simulation."""


def targets_of(results: Played) -> list[str]:
    """Return the targets in the order of play."""
    runs = next(iter(results.values()))
    return list(dict.fromkeys(outcome.target for outcome in runs[0]))


def by_target(runs: Runs, values: str = "success") -> intervals.Floats:
    """Return the mean of an outcome's attribute by run and target, shape (runs, targets)."""
    words = targets_of({"": runs})
    table = np.zeros((len(runs), len(words)))
    for k, run in enumerate(runs):
        for m, word in enumerate(words):
            table[k, m] = np.mean([getattr(each, values) for each in run if each.target == word])
    return table


def ends(runs: Runs) -> dict[str, int]:
    """Return the number of episodes with each end that `ENDS` lists."""
    counts: Counter[str] = Counter()
    for each in (each for run in runs for each in run):
        other = "other fold" if each.status == "folded" else each.status
        counts["target" if each.success else other] += 1
    return {end: counts[end] for end in ENDS}


@dataclass(frozen=True)
class Summary:
    """The summary of the runs of one method."""

    success: intervals.Estimate
    """Mean success rate over runs and targets."""
    iqm: intervals.Estimate
    """Interquartile mean of the success rate."""
    score: intervals.Estimate
    """Mean score."""
    reward: intervals.Estimate
    """Mean return."""
    built: intervals.Estimate | None
    """Success rate of the same choices as chains built beforehand; None if not tried."""
    ahead: intervals.Estimate | None
    """Lead in success over `REFERENCE` on the same targets; None for `REFERENCE` or without it."""
    targets: dict[str, Share]
    """Success by target over all runs, with Wilson's intervals."""
    ends: dict[str, int]
    """Number of episodes with each end."""


def summarise(results: Played) -> dict[str, Summary]:
    """Return the summary of each method."""
    targets = targets_of(results)
    reference = by_target(results[REFERENCE]) if REFERENCE in results else None
    found: dict[str, Summary] = {}
    for name, runs in results.items():
        success = by_target(runs)
        other = None if name == REFERENCE else reference
        tried = runs[0][0].built is not None
        ended = {
            target: [each.success for run in runs for each in run if each.target == target]
            for target in targets
        }
        found[name] = Summary(
            success=intervals.estimate(success, targets),
            iqm=intervals.estimate(success, targets, intervals.interquartile_mean),
            score=intervals.estimate(by_target(runs, "score"), targets),
            reward=intervals.estimate(by_target(runs, "reward"), targets),
            built=intervals.estimate(by_target(runs, "built"), targets) if tried else None,
            ahead=None if other is None else intervals.difference(success, other, targets),
            targets={target: share(sum(each), len(each)) for target, each in ended.items()},
            ends=ends(runs),
        )
    return found


def targets_rows(summaries: Mapping[str, Summary]) -> list[dict[str, str]]:
    """Return numbers of successes, with one row per target and one column per method."""
    targets = next(iter(summaries.values())).targets
    return [
        {"target": word}
        | {
            name: f"{each.targets[word].successes}/{each.targets[word].trials}"
            for name, each in summaries.items()
        }
        for word in targets
    ]


def overall_rows(summaries: Mapping[str, Summary]) -> list[dict[str, str]]:
    """Return the summary table, with one row per method, whose name comes first."""
    rows = [
        {
            "": name,
            "success": str(each.success),
            "middle half": str(each.iqm),
            f"above the {REFERENCE}": "–" if each.ahead is None else each.ahead.points(),
            "built beforehand": "–" if each.built is None else str(each.built),
            "score": f"{each.score.value:.3f}",
            "return": f"{each.reward.value:+.3f}".replace("-", "−"),
        }
        for name, each in summaries.items()
    ]
    filled = [column for column in rows[0] if any(row[column] != "–" for row in rows)]
    return [{column: row[column] for column in filled} for row in rows]


def files_of(policies: Sequence[str]) -> tuple[File, ...]:
    """Return the names and checksums of policies' files for a file of results."""
    return tuple(File(name=policy, sha256=file_digest(policy)) for policy in policies)


def made(view: View, env_id: str, rows: Mapping[str, Row], **given: Any) -> Results:
    """Return a table of results, with the data needed to reproduce it; `view` is its kind."""
    return Results(
        view=view,
        id=env_id,
        draws=EVALUATION_VERSION,
        physics=physics_digest(),
        provenance=provenance(),
        rows=dict(rows),
        **given,
    )


def own_settings(settings: EnvSettings) -> dict[str, Any]:
    """Return the settings that differ from the environment's defaults, as JSON values."""
    return settings.model_dump(mode="json", exclude_defaults=True)


def results_of(
    settings: EnvSettings,
    methods: Sequence[episodes.Method],
    seeds: Sequence[int],
    played: Played,
    summaries: Mapping[str, Summary],
) -> Results:
    """Return all measured values of a comparison."""
    rows: dict[str, Row] = {}
    for method in methods:
        summary = summaries[method.name]
        shares = {word: [each.successes, each.trials] for word, each in summary.targets.items()}
        figures = {name: value for name, value in vars(summary).items() if name != "success"}
        rows[method.name] = Row(
            success=summary.success,
            score=summary.score.value,
            files=files_of(method.policies),
            runs=tuple(map(_run, played[method.name])),
            figures=figures | {"targets": shares},
        )
    given = {"tasks": tuple(targets_of(played)), "seeds": tuple(seeds)}
    return made("evaluation", settings.id, rows, env=own_settings(settings), **given)


def _run(outcomes: Sequence[episodes.Outcome]) -> Run:
    """Return a run's episodes as columns, with magnets and drawn speeds instead of scenes."""
    details: dict[str, Any] = {
        name: [getattr(each, name) for each in outcomes]
        for name in ("word", "status", "reward", "built", "built_score")
    }
    details["joints"] = [
        [angle if np.isfinite(angle) else None for angle in each.joints] for each in outcomes
    ]
    for k, name in enumerate(("sequence", "speeds")):
        details[name] = [each.choice and each.choice[k] for each in outcomes]
    details["drawn_speeds"] = [each.scene and each.scene.speeds.tolist() for each in outcomes]
    return Run.of(
        [each.success for each in outcomes],
        score=tuple(each.score for each in outcomes),
        details={name: tuple(column) for name, column in details.items()},
    )
