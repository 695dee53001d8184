"""Methods that are compared, what their outcomes come to, tables of it, and JSON for later.

Each method is one policy, or the policies that several seeds have trained.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from agents.evaluation import episodes, intervals
from agents.evaluation.shipped import shipped_files, shipped_names
from agents.settings import EnvSettings
from agents.training.folder import file_digest, provenance
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE
from magfold_env.files import write_text
from magfold_env.reporting.intervals import Share, share
from magfold_env.shapes import word_to_angles

FORMAT = "magfold_env evaluation 2"

REFERENCE = "minimiser"
"""The method that others are compared with, pair by pair."""

Runs = Sequence[Sequence[episodes.Outcome]]
"""The outcomes of each run of a method; all runs have the same targets and draws."""

Results = Mapping[str, Runs]
"""The runs of each method, by its name."""

ENDS = ("target", "other fold", "misfolded", "unsettled", "failed")
"""How an episode may end: in the target, at rest in another fold, at rest with a joint open,
not at rest when time or work ran out, or with numbers that broke down."""


@dataclass(frozen=True)
class Method:
    """What is compared under one name.

    Attributes
    ----------
    name : str
        As shown.
    policies : tuple of str
        What `agents.evaluation.policies.make_policy` understands, one a seed.
    """

    name: str
    policies: tuple[str, ...]

    @classmethod
    def parse(cls, text: str) -> "Method":
        """Return the method that ``NAME=PATH,PATH,...``, or a policy alone, stands for.

        A file's name without its ending is what it is called then, with its folder's for
        ``policy.zip``, the name that every training gives. The name of a set of shipped policies
        stands for the paths of all its seeds.

        Raises
        ------
        ValueError
            If a name or a policy is empty, or given twice.
        """
        name, separator, listed = text.rpartition("=")
        shipped = shipped_names()
        policies = tuple(
            path
            for each in listed.split(",")
            for path in (map(str, shipped_files(each)) if each in shipped else (each,))
        )
        if not all(policies) or (separator and not name) or len(set(policies)) < len(policies):
            raise ValueError(
                f"{text!r} is not allowed; must be random, minimiser, a path, or NAME=PATH,PATH,… "
                "with a path for each seed"
            )
        return cls(name or (listed if listed in shipped else _short(policies)), policies)


def _short(policies: Sequence[str]) -> str:
    path = Path(policies[0])
    return path.parent.name if path.name == "policy.zip" and path.parent.name else path.stem


def parse_methods(texts: Sequence[str]) -> list[Method]:
    """Return the methods that `texts` stand for.

    Raises
    ------
    ValueError
        If one is not allowed, or two have one name.
    """
    methods = [Method.parse(text) for text in texts]
    names = [method.name for method in methods]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"{twice[0]}: two methods have this name; give others, NAME=PATH")
    return methods


def targets_of(results: Results) -> list[str]:
    """Return the targets in the order in which they were played."""
    runs = next(iter(results.values()))
    return list(dict.fromkeys(outcome.target for outcome in runs[0]))


def by_target(runs: Runs, values: str = "success") -> intervals.Floats:
    """Return the mean of an attribute of the outcomes, shape (runs, targets)."""
    words = list(dict.fromkeys(outcome.target for outcome in runs[0]))
    table = np.zeros((len(runs), len(words)))
    for k, run in enumerate(runs):
        for m, word in enumerate(words):
            table[k, m] = np.mean([getattr(each, values) for each in run if each.target == word])
    return table


def pooled(runs: Runs, target: str | None = None) -> list[episodes.Outcome]:
    """Return the outcomes of all runs, for one target or for all."""
    return [each for run in runs for each in run if target in (None, each.target)]


def end_of(outcome: episodes.Outcome) -> str:
    """Return which of `ENDS` an episode came to."""
    if outcome.success:
        return "target"
    return "other fold" if outcome.status == "folded" else outcome.status


def ends(outcomes: Sequence[episodes.Outcome]) -> dict[str, int]:
    """Return how many episodes came to each end."""
    counts = Counter(map(end_of, outcomes))
    return {end: counts[end] for end in ENDS}


def open_joints(outcome: episodes.Outcome) -> list[int]:
    """Return the numbers of the joints that are not fully folded, to either side."""
    apart = np.abs(np.abs(np.array(outcome.joints)) - 0.5 * np.pi)
    return (np.flatnonzero(apart > SUCCESS_TOLERANCE) + 1).tolist()


def wrong_joints(outcome: episodes.Outcome) -> list[int]:
    """Return the numbers of the joints that are fully folded to the wrong side."""
    wanted = word_to_angles(outcome.target)
    apart = np.abs(np.array(outcome.joints) + wanted)
    return (np.flatnonzero(apart <= SUCCESS_TOLERANCE) + 1).tolist()


def joints_in_the_way(outcomes: Sequence[episodes.Outcome]) -> dict[str, list[int]]:
    """Return how often each joint stayed ``open`` or folded ``wrong`` in episodes that missed.

    Joint 1 comes first. Simulations that failed, and chains that were not all fed, do not count.
    """
    joints = max((len(outcome.joints) for outcome in outcomes), default=0)
    counts = {"open": np.zeros(joints, dtype=np.int64), "wrong": np.zeros(joints, dtype=np.int64)}
    for outcome in outcomes:
        if outcome.success or outcome.status == "failed":
            continue
        for kind, found in (("open", open_joints(outcome)), ("wrong", wrong_joints(outcome))):
            counts[kind][[joint - 1 for joint in found]] += 1
    return {kind: numbers.tolist() for kind, numbers in counts.items()}


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

    success: intervals.Estimate
    iqm: intervals.Estimate
    score: intervals.Estimate
    reward: intervals.Estimate
    built: intervals.Estimate | None
    ahead: intervals.Estimate | None
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
            success=intervals.estimate(success, targets),
            iqm=intervals.estimate(success, targets, intervals.interquartile_mean),
            score=intervals.estimate(by_target(runs, "score"), targets),
            reward=intervals.estimate(by_target(runs, "reward"), targets),
            built=intervals.estimate(by_target(runs, "built"), targets) if tried else None,
            ahead=None if other is None else intervals.difference(success, other, targets),
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
        if isinstance(value, intervals.Estimate)
        else value
        for name, value in vars(summary).items()
    }
    shares = {word: {"rate": each.rate, **asdict(each)} for word, each in summary.targets.items()}
    return values | {"targets": shares}


def _episode(outcome: episodes.Outcome) -> dict[str, Any]:
    """Return an episode as plain values; magnets and drawn speeds stand for its scene."""
    values = {key: value for key, value in vars(outcome).items() if key not in ("scene", "choice")}
    if outcome.choice is not None:
        values |= outcome.choice._asdict()
    if outcome.scene is not None:
        values["drawn_speeds"] = outcome.scene.speeds.tolist()
    return values


def _share(outcomes: Sequence[episodes.Outcome]) -> Share:
    return share(int(np.sum([each.success for each in outcomes])), len(outcomes))


def _points(found: intervals.Estimate | None) -> str:
    """Return a difference of shares and its interval, in points of per cent."""
    if found is None:
        return "–"
    value, low, high = (intervals.percent(float(each), "+") for each in found)
    return f"{value} ({low}…{high})"
