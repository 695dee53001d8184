"""Worst violations of the laws that the dynamics must hold, over random scenes.

Run as ``python -m magfold_env.laws.limits --scenes 40``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, get_args

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from magfold_env.fold import FoldStatus
from magfold_env.laws.along_folds import follow
from magfold_env.laws.free_motion import Kind, creep, momentum_errors, reversal_error
from magfold_env.laws.impacts import impact_error
from magfold_env.laws.outcomes import ending, hopeless_scenes
from magfold_env.laws.random_scenes import random_scene
from magfold_env.scene import Scene

IMPACTS_A_SCENE = 10
BREAKDOWN_STEPS = 20_000  # work cap of the hopeless scenes
SHOWN = 8  # seeds of a law that are listed


@dataclass
class Law:
    """The worst value of one quantity, and the seeds at which it was too large."""

    name: str
    allowed: float
    worst: float = 0.0
    count: int = 0
    broken: tuple[tuple[float, int], ...] = ()

    def add(self, seed: int, value: float | None) -> None:
        """Take a value into account; None is no value."""
        if value is None:
            return
        self.count += 1
        self.worst = max(self.worst, value)
        # Not ">": what is no number breaks every law.
        if not value <= self.allowed:
            self.broken = (*self.broken, (value, seed))

    @property
    def cells(self) -> tuple[str, ...]:
        """Return a row of the table; the worst seeds come first."""
        seeds = [str(seed) for _, seed in sorted(self.broken, reverse=True)[:SHOWN]]
        share = f"{len(self.broken)} of {self.count}"
        return self.name, f"{self.allowed:.0e}", f"{self.worst:.1e}", share, " ".join(seeds)


def along_folds(seeds: Iterable[int]) -> list[Law]:
    """Look at every step of the random scenes; passivity is judged with friction only."""
    overlap = Law("overlap, share of the side", 1e-3)
    past = Law("joint past its stop [rad]", 1e-3)
    rise = Law("rise of the energy, friction, no feed", 1e-6)
    smooth = Law("rise of the energy, no friction", 1e-4)
    failed = Law("folds that failed", 0.0)
    not_finite = Law("folds with a value that is no number", 0.0)
    for seed in seeds:
        scene = random_scene(seed)
        motion, session = follow(scene)
        overlap.add(seed, motion.overlap)
        past.add(seed, motion.past_stop)
        (rise if scene.friction > 0.0 else smooth).add(seed, motion.rise)
        failed.add(seed, float(session.status is FoldStatus.FAILED))
        not_finite.add(seed, float(not motion.finite))
    return [overlap, past, rise, smooth, failed, not_finite]


def free_motion(seeds: Iterable[int]) -> list[Law]:
    """Momenta, with and without contact, and reversed films."""
    cases = {
        (tolerance, contact): (
            Law(f"linear momentum at {tolerance:.0e}{', contact' * contact}", allowed),
            Law(f"angular momentum at {tolerance:.0e}{', contact' * contact}", allowed),
        )
        for tolerance, contact, allowed in (
            (1e-3, False, 1e-2),
            (1e-6, False, 1e-5),
            (1e-12, False, 1e-10),
            (1e-3, True, 1e-2),
            (1e-4, True, 1e-3),
        )
    }
    films = {
        (kind, tolerance): Law(f"reversed film, {kind} [rad]", tolerance)
        for kind in get_args(Kind)
        for tolerance in (1e-3, 1e-6, 1e-9)
    }
    for seed in seeds:
        for (tolerance, contact), laws in cases.items():
            for law, value in zip(
                laws, momentum_errors(seed, tolerance, contact=contact), strict=True
            ):
                law.add(seed, value)
        for (kind, tolerance), law in films.items():
            law.add(seed, reversal_error(kind, seed, tolerance))
    return [law for pair in cases.values() for law in pair] + list(films.values())


def single(
    name: str, allowed: float, seeds: Iterable[int], value: Callable[[int], float | None]
) -> Law:
    """Return a law about one value a seed; what raises an ArithmeticError breaks it."""
    law = Law(name, allowed)
    for seed in seeds:
        try:
            law.add(seed, value(seed))
        except ArithmeticError:
            law.add(seed, float("inf"))
    return law


def laws_table(laws: Iterable[Law]) -> Table:
    """Return the worst values beside what is allowed."""
    table = Table(title="Worst values over random scenes")
    for column in ("law", "allowed", "worst", "broken", f"seeds, worst first (up to {SHOWN})"):
        table.add_column(column, justify="left" if column[:3] in {"law", "see"} else "right")
    for law in laws:
        table.add_row(*law.cells, style="" if not law.broken else "red")
    return table


def breakdown_table(scenes: dict[str, Scene]) -> Table:
    """Return how hopeless scenes end."""
    table = Table(title=f"Breakdown; at most {BREAKDOWN_STEPS} steps")
    for column in ("scene", "steps", "how it ended", "wrong"):
        table.add_column(column)
    for name, scene in track(scenes.items(), "breaking down"):
        found = ending(scene)
        how = f"{found.outcome.status}: {found.outcome.message}" if found.outcome else "--"
        steps = str(found.outcome.steps) if found.outcome else "--"
        table.add_row(name, steps, how, found.wrong, style="red" if found.wrong else "")
    return table


def main(
    scenes: Annotated[int, typer.Option(min=1, help="Random scenes.")] = 40,
    first: Annotated[int, typer.Option(min=0, help="Seed of the first.")] = 0,
) -> None:
    """Measure every law and print the worst values."""
    seeds = range(first, first + scenes)
    impacts = range(first * IMPACTS_A_SCENE, (first + scenes) * IMPACTS_A_SCENE)
    laws = [
        *along_folds(track(seeds, "folding")),
        *free_motion(track(seeds, "throwing")),
        single("creep in 1000 s [rad]", 0.0, track(seeds, "waiting"), creep),
        single("impact law", 1e-8, track(impacts, "colliding"), impact_error),
    ]
    console = Console()
    console.print(laws_table(laws))
    console.print(breakdown_table(hopeless_scenes(BREAKDOWN_STEPS)))


if __name__ == "__main__":
    typer.run(main)
