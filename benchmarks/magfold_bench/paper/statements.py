"""The paper's statements about its sequences, as tests of a sequence.

Statements about energies either hold or do not. Statements about releases hold to a degree, so that
even a few releases can distinguish better sequences from worse ones.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from typing import NamedTuple

from magfold_env.ensembles.releases import Ensemble
from magfold_env.fold import FoldStatus
from magfold_env.minimiser import Mode

HOLDS = 0.5
"""Degree above which a statement holds."""
RARE = 0.1
"""Smallest share of releases for an outcome that occurs in the paper, and largest share for an
outcome that does not occur there."""

_BOTH: tuple[Mode, Mode] = ("free", "forward")
_EVERY: tuple[Mode, ...] = (*_BOTH, "backward")


class Released(NamedTuple):
    """The states of a sequence and the outcomes of its releases."""

    names: Mapping[str, str]
    """Words of this sequence's states, by the paper's names: S1A …."""
    stable: frozenset[str]
    """Words of stable states."""
    ends: Mapping[Mode, Ensemble]
    """Ensembles of releases, by mode."""

    def folded(self, mode: Mode) -> dict[str, float]:
        """Return the share of releases that end in each full fold."""
        outcomes = self.ends[mode].outcomes
        full = FoldStatus.FOLDED
        return {w: found.rate for (w, status), found in outcomes.items() if status is full}

    def rate(self, mode: Mode, name: str) -> float:
        """Return the share of releases that end in a state."""
        return self.folded(mode).get(self.names.get(name, ""), 0.0)

    def misfolded(self, mode: Mode) -> dict[str, float]:
        """Return, by nearest word, the share of releases that end without a full fold."""
        made = self.ends[mode]
        stopped = Counter[str](made.word[made.status != FoldStatus.FOLDED.value].tolist())
        return {word: count / len(made) for word, count in stopped.items()}


class Statement(NamedTuple):
    """A statement of the paper about releases."""

    name: str
    said: str
    """The statement in this project's words."""
    degree: Callable[[Released], float]
    """Degree from 0 to 1; the statement holds above `HOLDS`."""


def on_the_way(word: str, goal: str, outer: Collection[int]) -> bool:
    """Return whether a word is the goal except for some straight outer joints, numbered from 1."""
    straight = [joint for joint, letter in enumerate(word, start=1) if letter == "S"]
    turned = all(a in (b, "S") for a, b in zip(word, goal, strict=True))
    return bool(straight) and turned and set(straight) <= set(outer)


def _share(rate: float, whole: float) -> float:
    """Return a rate's share of a whole, reduced for rare outcomes; 0 if the whole is 0."""
    return rate / whole * min(1.0, rate / RARE) if whole else 0.0


def prefers(mode: Mode, name: str) -> Callable[[Released], float]:
    """Return a function for the degree to which a state is more frequent than other full folds."""

    def degree(made: Released) -> float:
        often = made.rate(mode, name)
        folds = made.folded(mode)
        other = max((r for word, r in folds.items() if word != made.names.get(name)), default=0.0)
        return _share(often, often + other)

    return degree


def _mostly(mode: Mode) -> Callable[[Released], float]:
    return lambda made: made.rate(mode, "S3A")


def _even(made: Released) -> float:
    """Return the degree to which S1A and S1C are equally frequent and no other fold is more so."""
    rarer = min(made.rate("backward", name) for name in ("S1A", "S1C"))
    return _share(rarer, max(made.folded("backward").values(), default=0.0))


def _several(made: Released) -> float:
    """Return the share of the second most frequent full fold, relative to the most frequent."""
    rates = sorted(made.folded("backward").values(), reverse=True)
    return _share(rates[1], rates[0]) if len(rates) > 1 else 0.0


def _rarer(made: Released) -> float:
    forward, backward = (made.rate(mode, "S1B") for mode in ("forward", "backward"))
    return max(0.0, 1.0 - backward / forward) if forward else 0.0


def _only_stable(*exceptions: str) -> Callable[[Released], float]:
    """Return a function that computes how nearly all full folds are stable or in ``exceptions``."""

    def degree(made: Released) -> float:
        allowed = made.stable | {made.names.get(name, "") for name in exceptions}
        folds = [(word, r) for mode in _EVERY for word, r in made.folded(mode).items()]
        total = sum(r for _, r in folds)
        good = sum(r for word, r in folds if word in allowed)
        return clear(good / total) if total else 0.0

    return degree


def clear(share: float) -> float:
    """Return 1 if ``share`` is at least 1 − `RARE`, else a degree too low to hold."""
    return 1.0 if share >= 1.0 - RARE else 0.5 * share


def _dragged(made: Released) -> float:
    """Return the share of free and forward misfolds with only the last two joints straight."""
    goal = made.names["S3A"]
    misfolds = [each for mode in _BOTH for each in made.misfolded(mode).items()]
    total = sum(rate for _, rate in misfolds)
    there = sum(rate for word, rate in misfolds if on_the_way(word, goal, (4, 5)))
    return there / total if total else 0.0


def _modes_matter(made: Released) -> float:
    stopped = [sum(made.misfolded(mode).values()) for mode in _EVERY]
    more = max(stopped[:2]) - stopped[2]
    return 0.6 + 0.4 * more if more > RARE else max(0.0, 0.5 * more / RARE)


RELEASES: dict[int, tuple[Statement, ...]] = {
    1: (
        Statement("1 free", "most folds are S1C, the local minimum", prefers("free", "S1C")),
        Statement("1 forward", "most folds are S1C", prefers("forward", "S1C")),
        Statement("1 backward", "S1A and S1C about equally often", _even),
        Statement("1 S1B", "S1B is much rarer backward than forward", _rarer),
        Statement("1 folds", "full folds are stable, or S1E", _only_stable("S1E")),
    ),
    2: (
        Statement("2 free", "most folds are S2B, the straight line", prefers("free", "S2B")),
        Statement("2 forward", "most folds are S2B", prefers("forward", "S2B")),
        Statement("2 backward", "several shapes about equally often", _several),
        Statement("2 folds", "full folds are stable", _only_stable()),
    ),
    3: (
        Statement("3 free", "most releases end in S3A", _mostly("free")),
        Statement("3 forward", "most releases end in S3A", _mostly("forward")),
        Statement("3 backward", "most releases end in S3A", _mostly("backward")),
        Statement("3 folds", "full folds are S3A", _only_stable()),
        Statement("3 misfolds", "in misfolds, only the last two joints are not folded", _dragged),
        Statement("3 modes", "misfolds are more frequent free or forward", _modes_matter),
    ),
}
"""Statements in sections 6.1 and 7, by sequence."""

ENERGIES: dict[int, dict[str, str]] = {
    1: {
        "1 gap": "S1B's energy is less than one per cent above S1A's",
        "1 five": "four of the five lowest states are stable",
        "1 conflict": "S1E's conflict is between 4 and 5",
        "1 movement": "of the stable states, S1C needs the least movement, or nearly the least",
        "1 line": "none of them is the straight line, which only sequence 2 has",
    },
    2: {"2 positive": "energies of S2A, S2B and S2C are positive"},
    3: {},
}
"""Statements about energies that not every candidate meets."""

CHAINS = {8: "chains of eight do not fold", 10: "chains of ten do not fold"}
"""Section 2: because of friction, chains of more than six components do not fold."""
