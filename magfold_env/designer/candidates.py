"""Sequences that speak for themselves by energy, before a single one is released."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from magfold_env.designer.annealing import Annealed, anneal_sequence, sequence_of_signs
from magfold_env.designer.exhaustive import Exhaustive
from magfold_env.designer.holding import held_signs
from magfold_env.designer.result import Objective
from magfold_env.designer.task import Task
from magfold_env.minimiser.energies import TIE, energy_unit
from magfold_env.shapes import is_fully_folded

Report = Callable[[float], object]
Sequences = list[tuple[str, ...]]

_APART = 4  # faces by which two candidates differ at least
_COUNT = 6  # of short chains
_STARTS = 3  # of annealing
_HELD = 24  # drawn without annealing


class Found(NamedTuple):
    """The best sequence of a search by energy."""

    sequence: tuple[str, ...] | None
    score: float | None
    """Its gap [J]; its tolerance if that was sought."""
    bound: float | None
    """What no sequence exceeds, proved; None if unknown."""
    certificate: str = ""


def best_by_energy(task: Task, calls: Counter[str], report: Report) -> Found:
    """Search for the best sequence under one of the objectives of energy."""
    if task.search == "exhaustive":
        return _best_of_all(task, calls)
    rng = np.random.default_rng(task.searching_seed)
    enough = TIE * energy_unit(task.scene) if task.objective == "ground" else np.inf
    kinds = [True, True, False, False] if is_fully_folded(task.target) else [False] * 4
    best: Annealed | None = None
    for done, holding in enumerate([True] if task.objective == "unique" else kinds):
        found = anneal_sequence(
            task.scene, task.target, rng, calls,
            tolerant=task.objective == "sensitivity", holding=holding, good_enough=enough,
        )  # fmt: skip
        best = found if best is None or found.score > best.score else best
        report((done + 1) / len(kinds))
        if best.score > enough:
            break
    assert best is not None
    return Found(best.sequence, best.score, bound=None)


def candidates(task: Task, calls: Counter[str], report: Report) -> Sequences:
    """Return sequences that differ and of which each is good by energy, for the dearer test.

    The target must be fully folded.
    """
    if task.search == "exhaustive":
        every = Exhaustive(task.scene, task.target)
        calls["energies"] += every.calls
        report(0.5)
        gaps, only = every.gaps(), every.only_stable()
        firsts = [every.best(gaps, only), every.best(every.tolerances()), every.best(gaps)]
        numbers = [number for number in firsts if number is not None]
        numbers += every.spread_out(gaps, _COUNT - len(numbers), _APART)
        return list(dict.fromkeys(every.sequence(number) for number in numbers))
    rng = np.random.default_rng(task.searching_seed)
    found: Sequences = []
    for done in range(_STARTS):
        annealed = anneal_sequence(task.scene, task.target, rng, calls, holding=True)
        found.append(annealed.sequence)
        report((done + 1) / _STARTS)
    return list(dict.fromkeys(found))


def held(task: Task) -> Sequences:
    """Return sequences of which the target is the only stable word, drawn evenly."""
    rng = np.random.default_rng([task.searching_seed, 2])
    drawn = [sequence_of_signs(held_signs(task.target, rng)[0]) for _ in range(_HELD)]
    return list(dict.fromkeys(drawn))


def _best_of_all(task: Task, calls: Counter[str]) -> Found:
    every = Exhaustive(task.scene, task.target)
    calls["energies"] += every.calls
    gaps = every.gaps()
    scores = gaps
    if task.objective == "sensitivity":
        scores = every.tolerances()
    elif task.objective == "unique":
        # The only stable word need not be the ground state.
        scores = np.where(every.only_stable(), 1.0 + gaps - gaps.min(), 0.0)
    number = every.best(scores)
    if number is None:
        return Found(None, None, None, _certificate(task.objective, every))
    score = float(scores[number] if task.objective == "sensitivity" else gaps[number])
    bound = score if task.objective in ("gap", "sensitivity") else None
    return Found(every.sequence(number), score, bound)


def _certificate(objective: Objective, every: Exhaustive) -> str:
    count = every.gaps().size
    if objective == "unique":
        return f"of none of all {count} sequences is it the only stable word"
    least = -every.gaps().max()
    lower = f"at least {least:.3g} J lower" if least > 0.0 else "as low"
    return (
        f"of none of all {count} sequences is it the only ground state; another word lies {lower}"
    )
