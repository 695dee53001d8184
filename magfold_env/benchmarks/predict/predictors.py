"""How often each predictor names the word, and the full fold, that the dynamics favour.

The dynamics favour the most frequent word of many releases. Predictors are the minimiser's three
searches and the most frequent word of a few releases with other draws. Where words are equally
frequent, either is right.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from magfold_env.ensembles import PREDICTORS, Ensemble, ensemble, predictions
from magfold_env.fold import FoldStatus
from magfold_env.laws.experiment import MODES, SEQUENCES, paper_scene, random_scenes
from magfold_env.minimiser import Mode
from magfold_env.reporting.statistics import share
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene

MANY, FEW, SCENES = 25, 5, 100
QUICK_MANY, QUICK_SCENES = 6, 2
DYNAMICS = f"dynamics, {FEW} releases"
NAMES = (*PREDICTORS.values(), DYNAMICS)

FOLDED = FoldStatus.FOLDED.value


@dataclass(frozen=True)
class Case:
    """A scene, its favoured words, and what each predictor names.

    Attributes
    ----------
    words, folds : tuple of str
        The most frequent words of all releases, and of those that folded fully.
    rate, folded : float
        Share of releases that end in a word of `words`, and share of those that fold fully.
    named_word, named_fold : dict
        The word that each predictor names for either; absent where it names none.
    """

    group: str
    mode: Mode
    sequence: tuple[str, ...]
    words: tuple[str, ...]
    folds: tuple[str, ...]
    rate: float
    folded: float
    named_word: dict[str, str]
    named_fold: dict[str, str]


def run(quick: bool, progress: Progress) -> Measurement:
    """Judge the predictors on the paper's sequences and on random ones, in each mode."""
    count, many = (QUICK_SCENES, QUICK_MANY) if quick else (SCENES, MANY)
    scenes = list(_scenes(count))
    cases: list[Case] = []
    for k, (group, mode, scene) in enumerate(scenes):
        progress(k / len(scenes), f"{group}, {mode}")
        cases.append(judge(group, mode, scene, many))
    title = f"most frequent of {many} releases"
    tables = [
        Table(f"How often the {title} is named: word", _summary(cases, fold=False)),
        Table(f"How often the {title} is named: full fold", _summary(cases, fold=True)),
    ]
    return Measurement("predictors", [_row(case) for case in cases], tables, _findings(cases))


def judge(group: str, mode: Mode, scene: Scene, many: int) -> Case:
    """Simulate a scene's favoured words and ask the predictors."""
    reference = ensemble(scene, many, seed=0)
    few = ensemble(scene, FEW, seed=1)
    by_energy = predictions(scene)
    words = reference.most_frequent()
    return Case(
        group,
        mode,
        scene.sequence,
        words,
        reference.most_frequent(FOLDED),
        reference.words[words[0]].rate,
        reference.probability(status=FOLDED).rate,
        by_energy | _first(few, None),
        by_energy | _first(few, FOLDED),
    )


def _first(few: Ensemble, status: str | None) -> dict[str, str]:
    words = few.most_frequent(status)
    return {DYNAMICS: words[0]} if words else {}


def _scenes(count: int) -> Iterator[tuple[str, Mode, Scene]]:
    for mode in MODES:
        for sequence in SEQUENCES:
            yield "paper", mode, paper_scene(sequence, mode)
        for scene in random_scenes(count, mode):
            yield "random", mode, scene


def _summary(cases: list[Case], *, fold: bool) -> list[Row]:
    """Return hits by group and mode; for folds, among the cases in which any release folded."""
    rows: list[Row] = []
    for group in ("paper", "random"):
        for mode in MODES:
            of = [c for c in cases if (c.group, c.mode) == (group, mode)]
            judged = [c for c in of if c.folds] if fold else of
            row: Row = {"sequences": group, "mode": mode, "judged": f"{len(judged)} of {len(of)}"}
            for name in NAMES:
                hits = sum(_hit(case, name, fold=fold) for case in judged)
                row[name] = str(share(hits, len(judged))) if judged else "--"
            rows.append(row)
    return rows


def _hit(case: Case, name: str, *, fold: bool) -> bool:
    if fold:
        return case.named_fold.get(name) in case.folds
    return case.named_word.get(name) in case.words


def _findings(cases: list[Case]) -> list[str]:
    found: list[str] = []
    for mode in MODES:
        of = [case for case in cases if (case.group, case.mode) == ("random", mode)]
        folded, rate = np.mean([(case.folded, case.rate) for case in of], axis=0)
        found.append(
            f"Random sequences, {mode}: {folded:.0%} of the releases fold fully; the most frequent "
            f"word takes {rate:.0%} of them on average: naming one word is not right more often."
        )
    return found


def _row(case: Case) -> Row:
    row: Row = {
        "sequences": case.group,
        "mode": case.mode,
        "sequence": " ".join(case.sequence),
        "most frequent word": " ".join(case.words),
        "its share": case.rate,
        "most frequent full fold": " ".join(case.folds),
        "folded": case.folded,
    }
    for name in NAMES:
        row[name] = case.named_word.get(name, "")
    row[f"{DYNAMICS}, full fold"] = case.named_fold.get(DYNAMICS, "")
    return row
