"""Worst violations of the laws that the dynamics must hold, over random scenes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import get_args

from magfold_bench.laws.along_folds import follow
from magfold_bench.laws.dense import look_inside
from magfold_bench.laws.random_scenes import random_scene
from magfold_env.fold import FoldStatus
from tests.laws.free_motion import Kind, momentum_errors, reversal_error


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


def along_folds(seeds: Iterable[int]) -> list[Law]:
    """Look at and inside every step of random scenes; passivity is judged with friction only."""
    overlap = Law("overlap, share of the side", 1e-3)
    past = Law("joint past its stop [rad]", 1e-3)
    rise = Law("rise of the energy, friction, no feed", 1e-5)
    smooth = Law("rise of the energy, no friction", 1e-4)
    failed = Law("folds that failed", 0.0)
    not_finite = Law("folds with a value that is no number", 0.0)
    for seed in seeds:
        scene = random_scene(seed)
        motion, session = follow(scene)
        inside, _ = look_inside(scene)
        overlap.add(seed, max(inside.casings, inside.solids))
        past.add(seed, inside.past_stop)
        (rise if scene.frictions.any() else smooth).add(seed, motion.rise)
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
