"""All the ways to thread a chain through the cells of an outline."""

from functools import lru_cache

from magfold_env.shapes import Outline

_TURNS = {"L": 1, "R": 3}
_HEADINGS = ((1, 0), (0, 1), (-1, 0), (0, -1))

Cell = tuple[int, int]


@lru_cache(maxsize=1024)
def words_of_outline(cells: Outline) -> tuple[str, ...]:
    """Return the fully folded words that cover exactly the cells of an outline, sorted.

    Every word is grown from each cell and heading, and stays on cells that are still free.

    Parameters
    ----------
    cells : Outline
        As `magfold_env.shapes.outline` gives it.
    """
    found: set[str] = set()
    for cell in cells:
        for quarter in range(4):
            _grow("", cell, quarter, frozenset(cells) - {cell}, found)
    return tuple(sorted(found))


def _grow(word: str, cell: Cell, quarter: int, free: frozenset[Cell], found: set[str]) -> None:
    """Add to `found` the words that begin with `word`, end at `cell`, and use up `free`."""
    if not free:
        found.add(word)
        return
    ahead = _HEADINGS[quarter]
    for letter, turn in _TURNS.items():
        turned = (quarter + turn) % 4
        step = _HEADINGS[turned]
        beyond = (cell[0] + ahead[0] + step[0], cell[1] + ahead[1] + step[1])
        if beyond in free:
            _grow(word + letter, beyond, turned, free - {beyond}, found)
