"""Fixed bodies: rectangles that a chain cannot enter, and walls built from them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from magfold_env.scene.base import FrozenModel, Number, Place, Size
from magfold_env.scene.errors import Problem, is_number, refuse, unless_positive
from magfold_env.scene.magnets import Array


class Rectangle(FrozenModel):
    """A fixed rectangle in the plane; casings collide with it as with the tube's walls."""

    position: tuple[Place, Place]
    """Centre [m]; the origin is the tube's mouth, or component 1's outer hinge at release."""
    size: tuple[Size, Size]
    """Lengths along the heading and across it [m]."""
    heading: Number = 0.0
    """Direction of the first length [rad]; 0 is along +x."""

    @property
    def axis(self) -> Array:
        """Unit vector along the heading, shape (2,), rounded to be the same on all machines."""
        return np.round([math.cos(self.heading), math.sin(self.heading)], 15)

    @property
    def corners(self) -> Array:
        """Corners [m], shape (4, 2), counter-clockwise from the front right corner."""
        along = 0.5 * self.size[0] * self.axis
        across = 0.5 * self.size[1] * np.array([-self.axis[1], self.axis[0]])
        return np.array(self.position) + np.array(
            [along - across, along + across, across - along, -across - along]
        )

    def overlaps(self, outline: Array) -> bool:
        """Return whether a convex, counter-clockwise outline (k, 2) [m] overlaps the rectangle."""
        # Two convex outlines overlap unless an edge of one of them separates them.
        for edges in (self.corners, outline):
            for start, stop in pairwise([*edges, edges[0]]):
                x, y = stop - start
                outward = np.array([y, -x])
                one, other = self.corners @ outward, outline @ outward
                if one.max() <= other.min() or other.max() <= one.min():
                    return False
        return True


Obstacles = Annotated[tuple[Rectangle, ...], Field(max_length=64)]


def channel(
    start: tuple[float, float], end: tuple[float, float], width: float, wall: float = 0.001
) -> tuple[Rectangle, ...]:
    """Return the two walls of a straight channel.

    Parameters
    ----------
    start, end
        Ends of the channel's middle line [m].
    width
        Distance between the walls [m].
    wall
        Thickness of the walls [m].

    Raises
    ------
    SceneError
        If an end is not two finite numbers, or a length is not positive.
    """
    _refuse_unless_points(start=start, end=end)
    x, y = end[0] - start[0], end[1] - start[1]
    length = math.hypot(x, y)
    _refuse_unless_positive(length=length, width=width, wall=wall)
    aside, heading = 0.5 * (width + wall) / length, math.atan2(y, x)
    places = (
        (0.5 * (start[0] + end[0]) - side * y, 0.5 * (start[1] + end[1]) + side * x)
        for side in (aside, -aside)
    )
    return tuple(Rectangle(position=at, size=(length, wall), heading=heading) for at in places)


def chamber(
    corner: tuple[float, float],
    size: tuple[float, float],
    opening: float,
    wall: float = 0.001,
) -> tuple[Rectangle, ...]:
    """Return the walls of a rectangular chamber; the x axis passes through an opening on the left.

    Parameters
    ----------
    corner
        Lower left inner corner [m].
    size
        Inner lengths along x and y [m].
    opening
        Width of the opening [m], which is in the left wall and symmetric about y = 0.
    wall
        Thickness of the walls [m].

    Raises
    ------
    SceneError
        If `corner` or `size` is not two finite numbers, a length is not positive, or the opening
        does not lie within the left wall.
    """
    _refuse_unless_points(corner=corner, size=size)
    (left, low), (length, height) = corner, size
    _refuse_unless_positive(length=length, height=height, opening=opening, wall=wall)
    right, high = left + length, low + height
    half = 0.5 * opening
    if not low < -half < half < high:
        allowed = f"must lie within the left wall, from y = {low:.6g} to {high:.6g}"
        refuse([Problem("opening", opening, allowed)])
    sides = [
        (left - wall, right + wall, high, high + wall),
        (left - wall, right + wall, low - wall, low),
        (right, right + wall, low, high),
        (left - wall, left, half, high),
        (left - wall, left, low, -half),
    ]
    return tuple(
        Rectangle(position=(0.5 * (a + b), 0.5 * (c + d)), size=(b - a, d - c))
        for a, b, c, d in sides
    )


def funnel(
    bore: float, length: float, angle: float = math.pi / 4, wall: float = 0.001
) -> tuple[Rectangle, ...]:
    """Return the two walls of a funnel at the tube's mouth, which guides a chain back inside.

    Parameters
    ----------
    bore
        Inner width of the tube [m].
    length
        Length of each wall, which begins at the mouth's rim [m].
    angle
        Angle between a wall and the tube's axis [rad], more than 0 and less than π/2.
    wall
        Thickness of the walls [m].

    Raises
    ------
    SceneError
        If a length is not positive, or the angle is out of range.
    """
    _refuse_unless_positive(bore=bore, length=length, wall=wall)
    if not is_number(angle) or not 0.0 < angle < 0.5 * math.pi:
        refuse([Problem("angle", angle, "must be more than 0 and less than pi/2")])
    along, across = math.cos(angle), math.sin(angle)
    x = 0.5 * (length * along - wall * across)
    y = 0.5 * (bore + length * across + wall * along)
    return tuple(
        Rectangle(position=(x, side * y), size=(length, wall), heading=side * angle)
        for side in (1.0, -1.0)
    )


def _refuse_unless_positive(**lengths: object) -> None:
    refuse([each for key, value in lengths.items() for each in unless_positive(key, value)])


def _refuse_unless_points(**points: object) -> None:
    allowed = "must be two finite numbers"
    refuse([Problem(key, each, allowed) for key, each in points.items() if not _is_point(each)])


def _is_point(value: Any) -> bool:
    try:
        x, y = value
    except (TypeError, ValueError):
        return False
    return all(is_number(each) and math.isfinite(each) for each in (x, y))
