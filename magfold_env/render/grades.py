"""Which common NdFeB grade has a remanence."""

from __future__ import annotations

from typing import NamedTuple


class Grade(NamedTuple):
    """A grade as suppliers sell it: smallest and largest remanence [T]."""

    name: str
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.name}, {self.low:.2f}–{self.high:.2f} T"


# As suppliers' tables give them. Sintered grades agree between suppliers to 0.01 T; the names of
# bonded ones are less even, which is why ranges are printed with them.
GRADES = (
    Grade("bonded NdFeB BN2", 0.30, 0.38),
    Grade("bonded NdFeB BN3", 0.35, 0.43),
    Grade("bonded NdFeB BN4", 0.42, 0.50),
    Grade("bonded NdFeB BN5", 0.48, 0.55),
    Grade("bonded NdFeB BN6", 0.53, 0.60),
    Grade("bonded NdFeB BN7", 0.58, 0.65),
    Grade("bonded NdFeB BN8", 0.62, 0.68),
    Grade("bonded NdFeB BN10", 0.65, 0.71),
    Grade("NdFeB N30", 1.08, 1.13),
    Grade("NdFeB N33", 1.13, 1.17),
    Grade("NdFeB N35", 1.17, 1.22),
    Grade("NdFeB N38", 1.22, 1.25),
    Grade("NdFeB N40", 1.25, 1.28),
    Grade("NdFeB N42", 1.28, 1.32),
    Grade("NdFeB N45", 1.32, 1.38),
    Grade("NdFeB N48", 1.38, 1.42),
    Grade("NdFeB N50", 1.40, 1.45),
    Grade("NdFeB N52", 1.43, 1.48),
)


def nearest_grade(remanence: float) -> Grade:
    """Return the grade whose range holds a remanence [T], or the one that comes nearest to it.

    Of several ranges that hold it, the one in whose middle it lies most.
    """

    def distance(grade: Grade) -> tuple[float, float]:
        outside = max(grade.low - remanence, remanence - grade.high, 0.0)
        return outside, abs(remanence - (grade.low + grade.high) / 2.0)

    return min(GRADES, key=distance)


def grade_text(remanence: float) -> str:
    """Return in words which grade to buy for a remanence [T]."""
    grade = nearest_grade(remanence)
    if grade.low <= remanence <= grade.high:
        return str(grade)
    return f"no common grade; nearest {grade}"
