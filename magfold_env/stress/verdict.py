"""What the laws say about one case."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Broken:
    """A law that a case breaks."""

    law: str
    value: float
    """Nan where the law is not about a number."""
    allowed: float
    words: str = ""

    def __str__(self) -> str:
        number = "" if math.isnan(self.value) else f"{self.value:.3g}, allowed {self.allowed:.3g}"
        return ": ".join(part for part in (self.law, self.words, number) if part)


@dataclass
class Verdict:
    """How a case ended, the worst values of the laws that hold for it, and those it breaks."""

    status: str = ""
    message: str = ""
    steps: int = 0
    worst: dict[str, float] = field(default_factory=dict[str, float])
    """Value over what is allowed, by law."""
    broken: list[Broken] = field(default_factory=list[Broken])
    notes: list[str] = field(default_factory=list[str])
    """What was set aside, or could not be judged."""

    def judge(self, law: str, value: float, allowed: float, words: str = "") -> None:
        """Hold a value against what is allowed; what is no number breaks every law."""
        share = value / allowed
        self.worst[law] = max(self.worst.get(law, 0.0), share)
        if not value <= allowed:
            self.broken.append(Broken(law, value, allowed, words))

    def demand(self, law: str, holds: bool, words: str) -> None:
        """Note a law that is not about a number, with what is wrong if it does not hold."""
        self.worst[law] = max(self.worst.get(law, 0.0), 0.0 if holds else math.inf)
        if not holds:
            self.broken.append(Broken(law, math.nan, math.nan, words))
