"""The laws' verdict on a case, and the tally of many cases."""

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Self

Counts = Counter[str]


@dataclass(frozen=True)
class Broken:
    """A law that a case breaks."""

    law: str
    value: float
    """Measured value; NaN if the law is not about a number."""
    allowed: float
    words: str = ""

    def __str__(self) -> str:
        number = "" if math.isnan(self.value) else f"{self.value:.3g}, allowed {self.allowed:.3g}"
        return ": ".join(part for part in (self.law, self.words, number) if part)


@dataclass
class Verdict:
    """The end of a case, the worst values by law, and the broken laws."""

    status: str = ""
    message: str = ""
    worst: dict[str, float] = field(default_factory=dict[str, float])
    """Largest value relative to the allowed value, by law."""
    broken: list[Broken] = field(default_factory=list[Broken])
    notes: list[str] = field(default_factory=list[str])
    """Reasons for exclusions, and checks that were not possible."""

    def bound(self, law: str, value: float, allowed: float, words: str = "") -> None:
        """Compare a value with the allowed value; NaN breaks every law."""
        share = value / allowed
        self.worst[law] = max(self.worst.get(law, 0.0), share)
        if not value <= allowed:
            self.broken.append(Broken(law, value, allowed, words))

    def require(self, law: str, holds: bool, words: str) -> None:
        """Record whether a law that is not about a number holds; ``words`` describe the problem."""
        self.worst[law] = max(self.worst.get(law, 0.0), 0.0 if holds else math.inf)
        if not holds:
            self.broken.append(Broken(law, math.nan, math.nan, words))


@dataclass
class Tally:
    """Counts of cases, and the cases that break a law; `vars` turns a tally into JSON values."""

    statuses: dict[str, Counts] = field(default_factory=dict[str, Counts])
    """Number of cases by kind and end."""
    held: Counts = field(default_factory=Counts)
    """Number of cases in which each law was checked."""
    worst: dict[str, tuple[float, str]] = field(default_factory=dict[str, tuple[float, str]])
    """Largest share of the allowed value among the cases that keep the law, and that case."""
    failures: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    """Name, kind and broken laws of the cases that break laws."""
    notes: Counts = field(default_factory=Counts)
    """Number of exclusions by reason."""
    seconds: float = 0.0
    """Processor time of all cases [s]."""

    def add(self, case: str, kind: str, verdict: Verdict, seconds: float) -> None:
        """Count a case, given its name, kind, verdict and processor time."""
        self.statuses.setdefault(kind, Counts())[verdict.status] += 1
        self.notes.update(verdict.notes)
        self.seconds += seconds
        broken = {each.law for each in verdict.broken}
        for law, share in verdict.worst.items():
            self.held[law] += 1
            if law not in broken and share > self.worst.get(law, (0.0, ""))[0]:
                self.worst[law] = (share, case)
        if broken:
            laws = [[each.law, str(each)] for each in verdict.broken]
            self.failures.append({"case": case, "kind": kind, "broken": laws})

    def merge(self, other: Self) -> None:
        """Add the counts of another tally."""
        for kind, counts in other.statuses.items():
            self.statuses.setdefault(kind, Counts()).update(counts)
        self.held.update(other.held)
        for law, worst in other.worst.items():
            self.worst[law] = max(self.worst.get(law, (0.0, "")), worst)
        self.failures += other.failures
        self.notes.update(other.notes)
        self.seconds += other.seconds

    @property
    def cases(self) -> int:
        """Number of cases."""
        return sum(counts.total() for counts in self.statuses.values())
