"""Where casings are: random pairs that do not overlap, touching ones included, and chains."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.laws.random_scenes import random_sequence
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import centres, folded_words, word_to_angles
from magfold_env.shapes import headings as joint_headings

UNFOLDED, FOLDED, AT_STOPS = "unfolded", "folded", "folded, at its stops"
OFF_STOP = 1e-6  # [rad]
FOLDED_SHARES = (0.05, 0.4, 0.8, 0.98, 1.0)  # of the joints' right angles
ROUNDING = 1e-9  # of a side: casings that touch do not overlap
FARTHEST = 0.1  # [m] gap of a random pair
ROOTS = np.radians([45.0, 135.0])  # edge normals of a casing, from its heading


def random_scene(rng: np.random.Generator, n: int) -> Scene:
    """Return a chain of random poles with the default magnets."""
    return Scene(sequence=random_sequence(rng, n), magnets=Magnets())


def separation(places: Array, headings: Array, side: float) -> float:
    """Return what separates two squares [m], by the edge normal that tells most; < 0: they overlap.

    Parameters
    ----------
    places : (2, 2) array
        Centres [m].
    headings : (2,) array
        Headings [rad].
    """
    return float(np.abs(_normals(headings) @ (places[1] - places[0])).max()) - _reach(
        headings, side
    )


def _normals(headings: Array) -> Array:
    """Edge normals of casings, (2·casings, 2)."""
    angles = np.add.outer(headings, ROOTS).ravel()
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _reach(headings: Array, side: float) -> float:
    """Half the projections of two squares on an edge normal of either [m]."""
    turn = headings[1] - headings[0]
    return float(0.5 * side * (1.0 + abs(np.cos(turn)) + abs(np.sin(turn))))


def random_pair(rng: np.random.Generator, side: float) -> tuple[Array, Array]:
    """Centres (2, 2) [m] and headings (2,) [rad] of two casings that touch or are near.

    A third lie flush and slide along each other, a third touch at any angle, the others are apart
    by any gap, evenly in its logarithm.
    """
    kind = rng.integers(3)
    if kind == 0:
        aside = side * rng.uniform(-1.2, 1.2) * rng.integers(2)
        gap = rng.choice([0.0, 1e-3]) * rng.random()
        places = np.array([[0.0, 0.0], [aside, side + gap]])
        headings = math.pi / 4.0 + np.array([0.0, rng.integers(4) * math.pi / 2.0])
    else:
        bearing, heading = rng.uniform(-math.pi, math.pi, 2)
        gap = 0.0 if kind == 1 else math.exp(rng.uniform(math.log(1e-5), math.log(FARTHEST)))
        headings = np.array([0.0, heading])
        direction = np.array([math.cos(bearing), math.sin(bearing)])
        along = np.abs(_normals(headings) @ direction).max()
        places = (_reach(headings, side) + gap) / along * np.stack([np.zeros(2), direction])
    return places, headings


def random_shape(rng: np.random.Generator, n: int, side: float) -> Array:
    """Headings (n,) [rad] of a chain without overlap: folded, nearly so, or nearly straight."""
    while True:
        share = rng.choice(FOLDED_SHARES)
        headings = joint_headings(word_to_angles(rng.choice(folded_words(n))) * share)
        places = centres(headings, side)
        pairs = (list(pair) for pair in combinations(range(n), 2))
        if all(separation(places[k], headings[k], side) > -ROUNDING * side for k in pairs):
            return headings


def unfolded(n: int) -> Array:
    """Headings (n,) [rad] of a chain that zigzags a little, as it is before it folds."""
    return 0.03 * np.tile([1.0, -1.0], n)[:n]


def folded(n: int) -> Array:
    """Headings (n,) [rad] of a chain folded into a compact block, for chains of any length.

    Staircases up and down, side by side, each of about √n casings; every joint is at a stop, left
    or right, and nothing overlaps.
    """
    most = max(2 * round(math.sqrt(n) / 2.0), 2)
    east, north = 0, 1
    quarters: list[int] = []
    while len(quarters) < n:
        quarters += [east, north] * (most // 2)
        # Westward from the last step north, then down along the staircase's left side.
        quarters += [2, 3] * (most // 2)
        # Westward again, and the next staircase begins with a step north.
        quarters += [2, north]
    # Differences of headings are joint angles.
    return np.unwrap(np.array(quarters[:n]) * (math.pi / 2.0))


def shapes(n: int) -> dict[str, Array]:
    """Return headings (n,) [rad] by the name of the shape."""
    block = folded(n)
    return {
        UNFOLDED: unfolded(n),
        FOLDED: block + OFF_STOP * (np.arange(n) % 2),
        AT_STOPS: block,
    }
