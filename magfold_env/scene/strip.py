"""The narrowest strip that contains the hinges of a chain."""

import math

import numpy as np

from magfold_env.scene.magnets import Array


def narrowest(cos: Array, sin: Array) -> tuple[Array, Array]:
    """Turn a chain so that the narrowest strip around its hinges is along +x.

    One edge of the hinges' convex hull is on a side of that strip [1]_. The method uses only sums,
    products and roots, so that equal cosines and sines (n,) of the headings give equal bits on all
    machines. It returns the cosines (n,) of the new headings, and the offsets (n + 1,) of the
    hinges to the left of the strip's middle, in distances between two hinges.

    References
    ----------
    .. [1] H. Freeman and R. Shapira, "Determining the minimum-area encasing rectangle for an
       arbitrary closed curve", Communications of the ACM 18 (1975).
    """
    x, y = (np.concatenate([[0.0], np.cumsum(each)]) for each in (cos, sin))
    corners = _hull(list(zip(x.tolist(), y.tolist(), strict=True)))
    least, best = math.inf, (1.0, 0.0)
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        dx, dy = x1 - x0, y1 - y0
        length = math.sqrt(dx * dx + dy * dy)
        c, s = dx / length, dy / length
        width = float(np.ptp(c * y - s * x))
        if width < least:
            least, best = width, (c, s)
    c, s = best
    if c * x[-1] + s * y[-1] < 0.0:
        c, s = -c, -s
    across = c * y - s * x
    middle = 0.5 * (across.min() + across.max())
    return c * cos + s * sin, across - middle


def _hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the corners of the convex hull of two or more points, counter-clockwise.

    The method is A. M. Andrew's monotone chain (Information Processing Letters 9, 1979).
    """
    points = sorted(points)
    hull: list[tuple[float, float]] = []
    for way in (points, points[::-1]):
        first = len(hull)
        for x, y in way:
            while len(hull) >= first + 2:
                (x0, y0), (x1, y1) = hull[-2:]
                if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0.0:
                    break
                hull.pop()
            hull.append((x, y))
        hull.pop()
    return hull
