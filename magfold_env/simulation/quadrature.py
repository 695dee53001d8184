"""Choose the number of quadrature nodes on a pole face, which depends on the distance.

The values come from an error map of single pairs of pole faces: the largest error of a pair's force
over non-overlapping poses, relative to the force between two flush opposite faces, as a function of
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

A bound on a component's total force needs more nodes than a bound on a pair's force, because errors
of pairs add up. Tests check the bounds on random pairs, including sliding ones, and on folded
chains.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.scene import Magnets


class Rule(NamedTuple):
    """Numbers of nodes per pole face by distance, for casings (*ranks*) and for faces (*levels*).

    Level 0 is the last rank. Ranks depend on the room between casings, which is the distance
    between their centres less twice the depth of the outer faces; levels depend on the distance
    between the faces' centres. Both distances are in widths of the widest pole face.
    """

    ranks: tuple[int, ...]  # nodes per face, from far to near
    rooms: tuple[float, ...]  # rooms within which the ranks after the first act
    levels: tuple[int, ...]  # nodes of near faces
    radii: tuple[float, ...]  # distances within which the levels act
    graded: int = 0  # nodes of faces that may touch, see `graded_rule`; 0: as for other faces
    far: float = math.inf  # distance of casings beyond which they are expanded, in their diagonals
    order: int = 1  # order of that expansion; a field needs dipoles
    groups: float = math.inf  # the same for segments of the chain, per component


# The paper's faces rest at 1, 3.5 and 6 mm from each other. Where the bound allows, the radii keep
# these distances out of the zones where two levels are blended. Ranks begin where the blended error
# of two casings, for their worst charges, is a third of the bound. A fold begins slowly under weak
# distant forces, of which the bound allows a large share, so distant casings decide the timing
# error of a fold. Single nodes, with an error of a hundredth of the force at any distance, are
# therefore for the loosest bound only, and the order of expansions leaves a smaller error than the
# solver's tolerance. Casings on a grid are 1.58 or 2 diagonals apart but never in between, where
# blending needs both nodes and expansions and costs both times.
TABLE = {
    5e-2: Rule((1, 2), (1.2,), (4, 8), (6.2 / 6.0, 3.1 / 6.0), 12, 1.59, 5, 1.45),
    1e-2: Rule((2, 3), (0.8,), (6, 10), (6.2 / 6.0, 3.1 / 6.0), 16, 1.59, 5, 2.05),
    1e-3: Rule((2, 4), (1.35,), (7, 14), (6.2 / 6.0, 4.2 / 6.0), 16, 1.59, 6, 3.05),
    1e-4: Rule((2, 3, 5), (3.5, 1.3), (12, 18), (6.2 / 6.0, 3.1 / 6.0), 24, 1.59, 7, 4.75),
    1e-6: Rule((2, 3, 5, 8), (5.5, 2.3, 1.2), (20, 24), (7.0 / 6.0, 4.2 / 6.0), 40, 2.55, 7, 8.05),
    0.0: Rule((12,), (), (24, 32), (7.0 / 6.0, 4.2 / 6.0), 64),
}
# The rule for energy sums that splines interpolate, with errors of 1e-8, below the splines' errors.
TABLE_RULE = Rule((8,), (), (16, 32), (1.5, 1.0), 64)
# Touching faces of the magnets in the table are a sixth of their width apart.
TABLE_GAP = 1.0 / 6.0


def single_rule(count: int) -> Rule:
    """Return the rule with ``count`` nodes everywhere."""
    return Rule((count,), (), (), ())


def choose_rule(magnets: Magnets) -> Rule:
    """Return the rule for magnets with a fixed number of nodes or with an error bound."""
    if not magnets.bounded:
        return single_rule(magnets.nodes or 3)
    return next(rule for bound, rule in TABLE.items() if magnets.accuracy >= bound)


def widest(magnets: Magnets) -> float:
    """Return the width of the widest pole face [m]."""
    return float(np.max(magnets.width))


def width_rule(strips: bool, count: int) -> tuple[Array, Array]:
    """Return offsets (in widths) and charge shares of ``count`` nodes across a pole face."""
    if strips:
        return _gauss_legendre(count)
    return np.linspace(-0.5, 0.5, count) if count > 1 else np.zeros(1), np.full(count, 1.0 / count)


def graded_rule(count: int) -> tuple[Array, Array]:
    """Like `width_rule`, with nodes that are denser towards both ends, for logarithmic functions.

    They are Gauss-Legendre nodes, moved by a function whose slope has a double zero at both ends.
    """
    offset, share = _gauss_legendre(count)
    x = offset + 0.5
    return x * x * x * (10.0 + x * (6.0 * x - 15.0)) - 0.5, share * 30.0 * (x * (1.0 - x)) ** 2


@lru_cache(maxsize=64)
def _gauss_legendre(count: int) -> tuple[Array, Array]:
    """Return offsets and shares on a width of 1, equal to the last bit on every machine.

    NumPy's values are exact too, but processors round differently. A Newton step from nodes rounded
    to nine digits squares their error.
    """
    x = np.round(np.polynomial.legendre.leggauss(count)[0], 9)
    slope = np.ones(count)
    for _ in range(2):
        before, value = np.zeros(count), np.ones(count)
        for k in range(1, count + 1):
            before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
        slope = count * (before - x * value) / (1.0 - x * x)
        x = x - value / slope
    return x / 2.0, 1.0 / ((1.0 - x * x) * slope * slope)
