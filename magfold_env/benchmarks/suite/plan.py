"""Which parts of which benchmarks the suite runs, in which order, and what a quick run leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Literal

from magfold_env.benchmarks.runner import Benchmark, Description, Runner

Effort = Literal["quick", "full"]

BENCHMARKS = ("whole", "dynamics", "magnets", "energy", "predict", "design", "env")
"""In the order of the report."""

LEFT_OUT = {
    "dynamics first-use": "it compiles the engine anew, which takes most of a minute",
    "design searches": "it takes most of a minute",
}
"""What `--quick` leaves out, and why."""


@dataclass(frozen=True)
class Entry:
    """One part of one benchmark."""

    benchmark: Benchmark
    part: str

    @property
    def name(self) -> str:
        """Both names."""
        return f"{self.benchmark.name} {self.part}"

    @property
    def about(self) -> Description:
        """What is said about it."""
        return self.benchmark.about[self.part]

    @property
    def runner(self) -> Runner:
        """What measures it."""
        return self.benchmark.parts[self.part]

    @property
    def command(self) -> str:
        """What repeats it alone."""
        return f"magfold bench {self.benchmark.name} --only {self.part}"


def entries(effort: Effort, names: Sequence[str] = BENCHMARKS) -> list[Entry]:
    """Return the parts of a run, in order."""
    found: list[Entry] = []
    for name in names:
        make: Callable[[], Benchmark] = import_module(
            f"magfold_env.benchmarks.{name}.command"
        ).benchmark
        benchmark = make()
        found += [Entry(benchmark, part) for part in benchmark.parts]
    return [each for each in found if effort == "full" or each.name not in LEFT_OUT]
