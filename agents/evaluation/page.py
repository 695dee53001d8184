"""Pictures of a comparison, and one HTML file of numbers, pictures and folds that play.

Pictures need matplotlib, from the extra `render`.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import magfold_env as mf
from agents.evaluation import episodes, report
from agents.settings import EnvSettings
from agents.training.folder import provenance
from magfold_env.fold import recording
from magfold_env.replay import page, page_data
from magfold_env.reporting import page as reporting
from magfold_env.reporting.page import Block, Details, Frame, Page, Picture, Section, Verdict
from magfold_env.reporting.plotting import COLOURS, GRID, INK, figure_class, save_figure
from magfold_env.reporting.tables import Cell, Row, Table

FRAME_RATE = 120.0
"""Recorded frames per simulated second [1/s]."""

_CAPTIONS = {
    "overall": "Success with 95 % intervals.",
    "reasons": "How episodes ended, and which joints were in the way of those that missed.",
    "targets": "Success by target with Wilson's 95 % intervals; dots are single seeds.",
}
_MEANING = (
    "Intervals: 95 %, bootstrap over seeds and targets together. Middle half: the mean of the "
    "middle half of all seeds on all targets (interquartile mean). Built beforehand: the same "
    "magnets and speeds under the same draws, in a chain whose magnets act inside the tube "
    "already; only that is a buildable design. Score and return are means."
)
_SHOWN = (
    "The first draw of some targets, evenly picked, and a miss if these have none: the target, and "
    "what became of it. Playing folds needs JavaScript."
)
_FOLDS = "folds"
"""Group of blocks; only one of them is open at a time."""
WIDTH = 9.0
"""Width of every picture [inch]."""

_END_COLOURS = dict(
    zip(report.ENDS, ("#009e73", "#e69f00", "#d55e00", "#56b4e9", "#26292e"), strict=True)
)


class Replay(NamedTuple):
    """A fold that is shown."""

    outcome: episodes.Outcome
    page: str
    """A self-contained page that plays the fold."""


def replays(results: report.Played, count: int) -> dict[str, list[Replay]]:
    """Return the same episodes of every method as pages, and a miss of each if there is one.

    They are the first draws of `count` evenly spaced targets, from a method's first run; outcomes
    play no part in the selection. If none of them missed, the first missed episode is added.
    """
    words = spread(report.targets_of(results), count)
    return {
        name: [
            Replay(outcome, page(page_data(recording(recorded(outcome)))))
            for outcome in _shown(runs, words)
        ]
        for name, runs in results.items()
    }


def recorded(outcome: episodes.Outcome) -> mf.Fold:
    """Simulate a replayable episode again and return it with its motion."""
    assert outcome.scene is not None
    return mf.simulate(outcome.scene, frame_rate=FRAME_RATE)


def spread(words: Sequence[str], count: int) -> list[str]:
    """Return `count` evenly spaced words, or all if there are fewer."""
    return list(words[:: max(1, len(words) // count)][:count])


def firsts(outcomes: Sequence[episodes.Outcome], words: Sequence[str]) -> list[episodes.Outcome]:
    """Return the first episode of each of `words` that can be replayed."""
    found: dict[str, episodes.Outcome] = {}
    for outcome in outcomes:
        if outcome.scene is not None:
            found.setdefault(outcome.target, outcome)
    return [found[word] for word in words if word in found]


def _shown(runs: report.Runs, words: Sequence[str]) -> list[episodes.Outcome]:
    shown = firsts(runs[0], words)
    missed = [each for each in runs[0] if not each.success and each.scene is not None]
    if missed and all(each.success for each in shown):
        shown.append(missed[0])
    return shown


def write_page(
    path: Path,
    settings: EnvSettings,
    draws: int,
    summaries: Mapping[str, report.Summary],
    pictures: Mapping[str, Path],
    shown: Mapping[str, Sequence[Replay]],
) -> None:
    """Write the self-contained page.

    `draws` is the number of episodes of each run on each target, `pictures` contains PNG files by
    content, and `shown` the folds to play by method.
    """
    charts = {name: Picture(pictures[name], caption) for name, caption in _CAPTIONS.items()}
    overall = [dict[str, Cell](row) for row in report.overall_rows(summaries)]
    by_target = [dict[str, Cell](row) for row in report.targets_rows(summaries)]
    in_all: list[Block] = [
        Table("Methods", overall),
        charts["overall"],
        Details("What is what", [_MEANING]),
        Details("Reasons", [charts["reasons"]]),
    ]
    every = Details("All targets", [charts["targets"], Table("Successes of episodes", by_target)])
    sections = [
        Section("In all", in_all),
        Section("Folds", _folds(shown)),
        Section("By target", [*_missed(summaries), every]),
    ]
    given = [name for name in summaries if name not in report.USUAL] or list(summaries)
    title = f"Evaluation of {' and '.join(given)}"
    made = {key: _text(value) for key, value in provenance().items()}
    lead = [*_answers(summaries, given), conditions(settings, draws)]
    reporting.write_page(Page(title, sections, lead, made), path)


def _answers(summaries: Mapping[str, report.Summary], given: Sequence[str]) -> list[Block]:
    """Return the findings on each given method, then on the others."""
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


def _missed(summaries: Mapping[str, report.Summary]) -> list[Block]:
    """Return the targets that any method except random choices missed."""
    judged = {name: each.targets for name, each in summaries.items() if name != report.RANDOM}
    rows: list[Row] = [
        {"target": word, **{name: str(each.targets[word]) for name, each in summaries.items()}}
        for word in next(iter(summaries.values())).targets
        if any(shares[word].rate < 1.0 for shares in judged.values())
    ]
    if not rows:
        return [f"None but {report.RANDOM} choices missed a target in any episode."]
    return [Table(f"Targets that others than {report.RANDOM} choices missed", rows)]


def conditions(settings: EnvSettings, draws: int) -> str:
    """Return a text that names the environment and its changed options."""
    given = {"randomisation": "nominal"} | settings.unshaped().options()
    if not isinstance(given.get("targets", ""), str):
        del given["targets"]  # the tables name them
    told = ", ".join(f"{key} {_text(value)}" for key, value in given.items())
    return f"{settings.id}, {told}; {draws} draws of each target that no training or search saw."


def _folds(shown: Mapping[str, Sequence[Replay]]) -> list[Block]:
    """Return the folds to play, method by method."""
    if not any(shown.values()):
        return ["There is no motion to show: the chain was not simulated."]
    blocks: list[Block] = [_SHOWN]
    for k, (name, replays) in enumerate(shown.items()):
        folds: list[Block] = []
        for each in replays:
            said, first = _became(each.outcome), k == 0 and not folds
            folds.append(Details(said, [Frame(said, each.page)], _FOLDS, unfolded=first))
        blocks.append(Details(name, folds, unfolded=k == 0))
    return blocks


def _became(outcome: episodes.Outcome) -> str:
    became = "✓" if outcome.success else f"→ {outcome.word}, {outcome.status}"
    return f"{outcome.target} {became}"


def _text(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def draw(
    folder: Path, results: report.Played, summaries: Mapping[str, report.Summary]
) -> dict[str, Path]:
    """Write all pictures to `folder` and return their paths by content."""
    pictures = {
        "overall": _means(summaries),
        "targets": _bars(results, summaries),
        "reasons": _reasons(summaries),
    }
    paths = {name: folder / f"{name}.png" for name in pictures}
    for name, figure in pictures.items():
        save_figure(figure, paths[name])
    return paths


def _means(summaries: Mapping[str, report.Summary]) -> Any:
    """Draw mean, middle half and success when built beforehand, with their intervals."""
    figure, ((axes,),) = make_figure(0.9 + 0.5 * len(summaries))
    rows = (
        ("success", "fed and chosen at the mouth", "o", COLOURS[1]),
        ("iqm", "the same, middle half of targets and seeds", "D", COLOURS[6]),
        ("built", "same choices, built beforehand", "s", COLOURS[2]),
    )
    for k, (attribute, label, marker, colour) in enumerate(rows):
        shown = [
            (place, found)
            for place, summary in enumerate(summaries.values())
            if (found := getattr(summary, attribute)) is not None
        ]
        if shown:
            places = np.array([place for place, _ in shown]) + 0.22 * (k - 1)
            value, low, high = 100 * np.array([found for _, found in shown], dtype=float).T
            axes.errorbar(
                value, places, xerr=[value - low, high - value], fmt=marker, color=colour,
                markersize=5, capsize=2, linewidth=1.2, label=label,
            )  # fmt: skip
    axes.set_yticks(range(len(summaries)), list(summaries))
    axes.set_ylim(len(summaries) - 0.5, -0.5)
    axes.set_xlim(-2, 102)
    axes.set_xlabel("success [%], with 95 % intervals over seeds and targets")
    axes.grid(axis="x", color=GRID, linewidth=0.8)
    figure.legend(loc="outside upper right", ncols=3, frameon=False, fontsize=8)
    return figure


def _bars(results: report.Played, summaries: Mapping[str, report.Summary]) -> Any:
    """Draw bars by target, one row per method; dots are the runs of methods with several."""
    words = report.targets_of(results)
    figure, grid = make_figure(0.8 + 1.2 * len(results), rows=len(results))
    axes = grid[:, 0]
    places = np.arange(len(words))
    for place, (name, runs) in zip(axes, results.items(), strict=True):
        shares = [summaries[name].targets[word] for word in words]
        rates = 100 * np.array([each.rate for each in shares])
        ends = 100 * np.array([[each.low, each.high] for each in shares]).T
        place.bar(places, rates, color=COLOURS[6], width=0.75)
        error = np.abs(ends - rates)
        place.errorbar(places, rates, yerr=error, fmt="none", ecolor=INK, linewidth=0.9)
        if len(runs) > 1:
            for k, row in enumerate(100 * report.by_target(runs)):
                shift = 0.5 * (k / (len(runs) - 1) - 0.5)
                place.plot(places + shift, row, ".", color=COLOURS[1], markersize=4, clip_on=False)
        place.set_title(name, loc="left", fontsize=9)
        place.set_ylim(0, 104)
        place.set_yticks([0, 50, 100])
        place.grid(axis="y", color=GRID, linewidth=0.8)
    axes[-1].set_xlim(-0.6, len(words) - 0.4)
    axes[-1].set_xticks(places, words, rotation=90, fontsize=7, family="monospace")
    figure.supylabel("success [%]", fontsize=9)
    return figure


def _reasons(summaries: Mapping[str, report.Summary]) -> Any:
    """Draw the ends of episodes, and the joints that caused misses."""
    figure, (axes,) = make_figure(1.1 + 0.5 * len(summaries), columns=(2.2, 1, 1))
    left = np.zeros(len(summaries))
    totals = np.array([sum(each.ends.values()) for each in summaries.values()])
    places = np.arange(len(summaries))
    for end in report.ENDS:
        shares = 100 * np.array([each.ends[end] for each in summaries.values()]) / totals
        axes[0].barh(places, shares, left=left, color=_END_COLOURS[end], label=end, height=0.7)
        left += shares
    axes[0].set_yticks(places, list(summaries))
    axes[0].set_ylim(len(summaries) - 0.5, -0.5)
    axes[0].set_xlim(0, 100)
    axes[0].set_xlabel("episodes [%]")
    for place, kind, title in zip(
        axes[1:], ("open", "wrong"), ("joint left open", "joint folded wrong"), strict=True
    ):
        missed = totals - np.array([each.ends["target"] for each in summaries.values()])
        counts = np.array([each.joints[kind] for each in summaries.values()], dtype=float)
        shares = 100 * counts / np.maximum(missed, 1)[:, None]
        place.imshow(shares, vmin=0, vmax=100, cmap="Oranges", aspect="auto")
        for (row, column), value in np.ndenumerate(shares):
            colour = "white" if value > 60 else INK
            label = f"{value:.0f}" if missed[row] else "–"
            style: Any = {"ha": "center", "va": "center", "fontsize": 7}
            place.text(column, row, label, color=colour, **style)
        place.set_xticks(range(counts.shape[1]), [str(k + 1) for k in range(counts.shape[1])])
        place.set_yticks([])
        place.set_xlabel(f"{title}\n[% of misses]")
    figure.legend(loc="outside upper left", ncols=len(report.ENDS), frameon=False, fontsize=8)
    return figure


def make_figure(height: float, rows: int = 1, columns: tuple[float, ...] = (1,)) -> tuple[Any, Any]:
    """Return a figure and its axes, shape (rows, columns), without right and upper frames."""
    figure = figure_class()(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(
        rows, len(columns), sharex=rows > 1, squeeze=False, gridspec_kw={"width_ratios": columns}
    )
    for place in axes.flat:
        place.spines[["top", "right"]].set_visible(False)
        place.tick_params(labelsize=8, colors=INK)
        place.xaxis.label.set_size(9)
        place.yaxis.label.set_size(9)
        place.set_axisbelow(True)
    return figure, axes
