"""What many cases add up to."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from magfold_env.stress.case import Case
from magfold_env.stress.verdict import Verdict

Counts = Counter[str]


def _kinds() -> dict[str, Counts]:
    return {}


@dataclass
class Tally:
    """Counts of cases, and those that break a law; values that JSON can hold."""

    statuses: dict[str, Counts] = field(default_factory=_kinds)
    """How many of each kind ended how."""
    held: Counts = field(default_factory=Counts)
    """For how many cases each law was judged."""
    worst: dict[str, tuple[float, str]] = field(default_factory=dict[str, tuple[float, str]])
    """Largest share of what is allowed among the cases that keep the law, and the case."""
    failures: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    """Name, kind and broken laws of the cases that break one."""
    notes: Counts = field(default_factory=Counts)
    """What was set aside."""
    seconds: float = 0.0
    """Processor time."""

    def add(self, case: Case, verdict: Verdict, seconds: float) -> None:
        """Count a case."""
        self.statuses.setdefault(case.kind, Counts())[verdict.status] += 1
        self.notes.update(verdict.notes)
        self.seconds += seconds
        broken = {each.law for each in verdict.broken}
        for law, share in verdict.worst.items():
            self.held[law] += 1
            if law not in broken and share > self.worst.get(law, (0.0, ""))[0]:
                self.worst[law] = (share, case.name)
        if broken:
            laws = [[each.law, str(each)] for each in verdict.broken]
            self.failures.append({"case": case.name, "kind": case.kind, "broken": laws})

    def merge(self, other: Tally) -> None:
        """Count what another one counts."""
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
        """How many."""
        return sum(counts.total() for counts in self.statuses.values())

    def broken(self) -> dict[str, Counts]:
        """Return how many cases break each law, by kind."""
        found: dict[str, Counts] = {}
        for failure in self.failures:
            for law in {law for law, _ in failure["broken"]}:
                found.setdefault(law, Counts())[failure["kind"]] += 1
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return everything as values that JSON can hold."""
        return {name: getattr(self, name) for name in type(self).__dataclass_fields__}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Tally:
        """Return the tally that `to_dict` was made of."""
        statuses = {kind: Counts(counts) for kind, counts in data["statuses"].items()}
        worst = {law: (share, case) for law, (share, case) in data["worst"].items()}
        return cls(
            statuses,
            Counts(data["held"]),
            worst,
            data["failures"],
            Counts(data["notes"]),
            data["seconds"],
        )
