"""Tables, and pictures of chains as SVG, for notebooks. They need no extra."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from magfold_env.reporting.page import Block, fragment
from magfold_env.reporting.tables import Row, Table

MOST_ROWS = 20
"""Largest number of rows that a notebook shows of a table."""
SMALL = 0.004
"""Side of casings in small pictures [m], in which only component 1 has a number."""

_CASING, _EDGE, _INK = "#dee3e8", "#4a525c", "#26292e"
_POLES = {"N": "#ce3830", "S": "#2a62b0"}


class NotebookDisplay:
    """An object that Jupyter and other notebooks show as HTML."""

    def _shown(self) -> Sequence[Block]:
        """Return the content to show: texts, tables, pictures and frames."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        """Return the content as HTML, for notebooks."""
        return fragment(self._shown())


def short_table(title: str, rows: Iterable[Row], total: int) -> Table:
    """Return a table of the first `MOST_ROWS` of ``total`` rows; its title counts the others.

    The other rows are not computed.
    """
    more = f"; {total - MOST_ROWS} more" if total > MOST_ROWS else ""
    return Table(title + more, list(islice(rows, MOST_ROWS)))


def facts_table(title: str, facts: Mapping[str, object]) -> Table:
    """Return a table of facts, one per row."""
    return Table(title, [{"": name, "value": f"{value}"} for name, value in facts.items()])


def chain_svg(
    angles: npt.NDArray[np.float64],
    side: float = SMALL,
    sequence: Sequence[str] = (),
    sizes: Mapping[Any, Sequence[float]] | None = None,
) -> Markup:
    """Return a life-size picture of a chain, seen from above.

    The casings have headings ``angles`` (n,) [rad] and edges ``side`` [m]. Magnets are drawn if the
    sequence and their ``sizes`` are given: four widths, thicknesses and insets [m].
    """
    edge, turns = 1e3 * side, np.exp(1j * angles)
    diagonal = edge * np.sqrt(2.0)
    middles = diagonal * (np.cumsum(turns) - turns / 2.0)
    casing = diagonal / 2.0 * np.array([1.0, 1j, -1.0, -1j])
    shapes: list[str] = []
    for k, (middle, turn) in enumerate(zip(middles, turns, strict=True)):
        shapes.append(_polygon(middle + turn * casing, f'{_CASING}" stroke="{_EDGE}'))
        for f, pole in enumerate(sequence[k] if sizes else ""):
            if sizes and pole in _POLES:
                width, thickness, inset = (
                    1e3 * sizes[name][f] for name in ("width", "thickness", "inset")
                )
                outer = edge / 2.0 - inset
                depth = np.array([outer, outer, outer - thickness, outer - thickness])
                across = width / 2.0 * np.array([1j, -1j, -1j, 1j])
                normal = turn * np.exp(0.25j * np.pi * (1 + 2 * f))
                shapes.append(_polygon(middle + normal * (depth + across), _POLES[pole]))
        if side > SMALL or k == 0:
            place = f'x="{middle.real:.4f}" y="{-middle.imag:.4f}"'
            look = f'font-size="{max(0.3 * edge, 2.5):.3g}" text-anchor="middle" fill="{_INK}"'
            shapes.append(f'<text {place} {look} dominant-baseline="central">{k + 1}</text>')
    corners = (middles[:, None] + turns[:, None] * casing).ravel()
    left, top = corners.real.min() - 0.5, -corners.imag.max() - 0.5
    width, height = np.ptp(corners.real) + 1.0, np.ptp(corners.imag) + 1.0
    return Markup(
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="chain of {len(angles)}" '
        f'width="{width:.4f}mm" height="{height:.4f}mm" style="max-width: 100%" '
        f'viewBox="{left:.4f} {top:.4f} {width:.4f} {height:.4f}" stroke-width="0.2">'
        f"{''.join(shapes)}</svg>"
    )


def _polygon(corners: npt.NDArray[np.complex128], look: str) -> str:
    points = " ".join(f"{each.real:.4f},{-each.imag:.4f}" for each in corners)
    return f'<polygon points="{points}" fill="{look}"/>'
