"""A comparison as one HTML file, with numbers and animated folds."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import magfold_env as mf
from agents.evaluation import episodes, report
from agents.settings import EnvSettings
from agents.training.folder import provenance
from magfold_env.fold import recording
from magfold_env.replay import page, page_data
from magfold_env.reporting import page as reporting
from magfold_env.reporting.page import Block, Details, Frame, Page, Section, Verdict
from magfold_env.reporting.tables import Row, Table

FRAME_RATE = 120.0
"""Number of recorded frames per simulated second [1/s]."""

SHOWN = 4
"""Number of targets whose folds the page shows in motion."""

_MEANING = (
    "Intervals: 95 %, bootstrap over seeds and targets together; for single targets, they are "
    "Wilson's. Middle half: the mean of the middle half of all seeds on all targets "
    "(interquartile mean). Built beforehand: the same magnets and speeds under the same draws, as "
    "a chain whose magnets act inside the tube, too; only such a chain can be built. Score and "
    "return are means."
)
_SHOWN = (
    "The first draw of evenly spaced targets, plus a miss if none of them missed: the target and "
    "the result. Playing folds needs JavaScript."
)


def write_page(
    path: Path,
    settings: EnvSettings,
    draws: int,
    results: report.Played,
    summaries: Mapping[str, report.Summary],
) -> None:
    """Write the self-contained page.

    `draws` is the number of episodes of each run on each target.
    """
    given = [name for name in summaries if name not in report.USUAL] or list(summaries)
    overall: list[Row] = [dict(row) for row in report.overall_rows(summaries)]
    ends: list[Row] = [{"": name, **each.ends} for name, each in summaries.items()]
    rows: list[Row] = [
        {"target": word, **{name: str(each.targets[word]) for name, each in summaries.items()}}
        for word in report.targets_of(results)
    ]
    judged = {name: each.targets for name, each in summaries.items() if name != report.RANDOM}
    missed = [
        row
        for row in rows
        if any(shares[str(row["target"])].rate < 1.0 for shares in judged.values())
    ]
    sections = [
        Section(
            "Overall",
            [
                Table("Methods", overall),
                Details("Explanation", [_MEANING]),
                Details("Ends", [Table("Episodes by their end", ends)]),
            ],
        ),
        Section("Folds", _folds(settings, results)),
        Section(
            "By target",
            [
                Table(f"Targets that methods other than {report.RANDOM} choices missed", missed)
                if missed
                else f"Only {report.RANDOM} choices missed a target in any episode.",
                Details("All targets", [Table("Success", rows)]),
            ],
        ),
    ]
    lead = [*_answers(summaries, given), conditions(settings, draws)]
    made = {key: _text(value) for key, value in provenance().items()}
    title = f"Evaluation of {' and '.join(given)}"
    reporting.write_page(Page(title, sections, lead, made), path)


def _answers(summaries: Mapping[str, report.Summary], given: Sequence[str]) -> list[Block]:
    """Return the findings about each given method, then a comparison with the others."""
    answers: list[Block] = []
    for name in given:
        found = summaries[name]
        word, tone = "Measured", "plain"
        played = sum(found.ends.values())
        sentence = f"{name} reaches its target in {found.success} of {played} episodes"
        if found.ahead is not None:
            if found.ahead.low > 0:
                word, tone = "Ahead", "good"
            else:
                word, tone = ("Behind", "bad") if found.ahead.high < 0 else ("Level", "plain")
            gap = found.ahead.points(" points")
            sentence += f", {gap} against the {report.REFERENCE}'s designs"
        answers.append(Verdict(word, f"{sentence}.", tone))
    others = [f"{name} {each.success}" for name, each in summaries.items() if name not in given]
    return [*answers, f"For comparison: {', '.join(others)}."] if others else answers


def conditions(settings: EnvSettings, draws: int) -> str:
    """Return a text that names the environment and its changed options."""
    given = {"randomisation": "nominal"} | settings.unshaped().options()
    if not isinstance(given.get("targets", ""), str):
        del given["targets"]  # the tables name them
    changed = ", ".join(f"{key} {_text(value)}" for key, value in given.items())
    return f"{settings.id}, {changed}; {draws} draws per target, which no training or search saw."


def _folds(settings: EnvSettings, results: report.Played) -> list[Block]:
    """Return animated folds: the same episodes for every method, and a failure if there is one.

    The episodes are the first draws of evenly spaced targets, from a method's first run; outcomes
    do not affect this selection. If all of them succeeded, the first failed episode is added.
    """
    if settings.fidelity == "quasistatic":
        return ["There is no motion to show: the chain was not simulated."]
    targets = report.targets_of(results)
    words = targets[:: max(1, len(targets) // SHOWN)][:SHOWN]
    blocks: list[Block] = [_SHOWN]
    for name, runs in results.items():
        played = [each for each in runs[0] if each.scene is not None]
        firsts = {each.target: each for each in reversed(played) if each.target in words}
        shown = [firsts[word] for word in words if word in firsts]
        missed = [each for each in played if not each.success]
        if missed and all(each.success for each in shown):
            shown.append(missed[0])
        is_first = len(blocks) == 1
        # Only one of these is open at a time.
        folds: list[Block] = [
            Details(
                said := _became(each), [Frame(said, _replay(each))], "folds", is_first and not k
            )
            for k, each in enumerate(shown)
        ]
        blocks.append(Details(name, folds, unfolded=is_first))
    return blocks


def _replay(outcome: episodes.Outcome) -> str:
    """Simulate an episode again, and return a self-contained page that shows it in motion."""
    assert outcome.scene is not None
    return page(page_data(recording(mf.simulate(outcome.scene, frame_rate=FRAME_RATE))))


def _became(outcome: episodes.Outcome) -> str:
    became = "✓" if outcome.success else f"→ {outcome.word}, {outcome.status}"
    return f"{outcome.target} {became}"


def _text(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
