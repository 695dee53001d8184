"""How many nodes a pole face gets, and from which distance on.

The table is read off an error map of single pairs of pole faces
(``tests/engine/test_quadrature.py`` measures it again): the largest error of a pair's force over
non-overlapping poses, relative to the force between two flush opposite faces, as a function of
the distance of the faces' centres. With 6 mm wide faces behind 0.5 mm of casing:

=====  =======  =======  =======  =======  =======  =======
nodes  1 mm     3.5 mm   5 mm     7 mm     8.5 mm   12 mm
=====  =======  =======  =======  =======  =======  =======
2      5e-1     3e-1     9e-2     9e-3     2e-3     3e-4
3      2e-1     1e-1     4e-2     1e-3     1e-4     6e-6
4      1e-1     4e-2     1e-2     2e-4     9e-6     1e-7
6      2e-2     9e-4     1e-3     4e-6     5e-8     8e-11
8      6e-3     1e-3     1e-4     9e-8     3e-10    5e-14
12     3e-4     7e-6     5e-6     6e-11    9e-15    -
16     2e-5     2e-6     1e-7     4e-14    -        -
=====  =======  =======  =======  =======  =======  =======

A bound on a component's whole force needs more than a pair's, since errors of pairs add up; the
same tests check the bounds on random pairs, sliding ones included, and on folded chains.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from magfold_env.scene import Magnets

# accuracy -> nodes (far, middle, near) and the radii in widths of a pole face within which the
# second and the third count act. The paper's faces rest at 1, 3.5 and 6 mm from each other: where
# the bound allows, the radii keep these distances out of the zones where two levels are blended.
TABLE = (
    (1e-2, (3, 6, 10), (6.2 / 6.0, 3.1 / 6.0)),
    (1e-3, (4, 7, 12), (6.2 / 6.0, 4.2 / 6.0)),
    (1e-4, (5, 12, 16), (6.2 / 6.0, 3.1 / 6.0)),
    (1e-6, (8, 20, 24), (7.0 / 6.0, 4.2 / 6.0)),
    (0.0, (12, 24, 32), (7.0 / 6.0, 4.2 / 6.0)),
)
# Touching faces of the table's magnets are a sixth of their width apart.
TABLE_GAP = 1.0 / 6.0
MOST_NODES = 64


@dataclass(frozen=True)
class Rule:
    """Nodes a pole face at every level, and the distance within which a level acts [m]."""

    counts: tuple[int, ...]
    radii: tuple[float, ...]


def choose_rule(magnets: Magnets) -> Rule:
    """Pick the nodes for a fixed number or for an error bound."""
    if magnets.model == "points":
        return Rule((magnets.nodes or 3,), (0.0,))
    if magnets.nodes is not None:
        return Rule((magnets.nodes,), (0.0,))
    (far, middle, near), radii = next(
        (counts, radii) for bound, counts, radii in TABLE if magnets.accuracy >= bound
    )
    # Gauss-Legendre errors fall geometrically with nodes times distance over width.
    gap = max(2.0 * magnets.inset, 1e-9) / magnets.width
    near = min(MOST_NODES, max(near, math.ceil(near * TABLE_GAP / gap)))
    return Rule((far, middle, near), (0.0, radii[0] * magnets.width, radii[1] * magnets.width))
