"""Fold words for comparisons in tests."""

from itertools import product

from magfold_env.shapes import LETTERS, mirror, overlaps


def reverse(word: str) -> str:
    """Return the same shape's word from the other end, with letters flipped and reversed."""
    return mirror(word)[::-1]


def words(n: int) -> list[str]:
    """Return the words of n components without overlap, sorted L, R, S."""
    return sorted(w for w in map("".join, product(LETTERS, repeat=n - 1)) if not overlaps(w))
