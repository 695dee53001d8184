"""Symmetries of chains, and the split of chains into those for training and those for tests.

Three changes give an equivalent chain: all poles swapped, the mirror image, and the chain seen from
its other end. The eight images of a chain that they generate are its *orbit*. All images of a chain
are on the same side of a split, in every list, so no test chain is a training chain in disguise.
"""

import hashlib
import math
from collections.abc import Iterable, Sequence
from typing import Literal, get_args

import numpy as np

from magfold_env.scene import Problem, Scene
from magfold_env.scene.errors import refuse
from magfold_env.scene.obstacles import Rectangle

Side = Literal["train", "test"]
Split = Literal["train", "test", "all"]
SIDES: tuple[Side, ...] = get_args(Side)

TEST_SHARE = 6
"""One in this many orbits is for tests."""

_SWAPPED = str.maketrans("NS", "SN")

Faces = tuple[str, ...]
"""The faces of each component, four letters N or S each, component 1 first."""


def swapped(sequence: Iterable[str]) -> Faces:
    """Return a chain with N and S swapped, which changes no force."""
    return tuple(faces.translate(_SWAPPED) for faces in sequence)


def mirrored(sequence: Iterable[str]) -> Faces:
    """Return the mirror image of a chain, which folds into the mirror image of its word."""
    return tuple(faces[::-1] for faces in sequence)


def turned(sequence: Sequence[str]) -> Faces:
    """Return a chain counted from its other end."""
    return tuple(faces[2:] + faces[:2] for faces in sequence[::-1])


def orbit(sequence: Sequence[str]) -> frozenset[Faces]:
    """Return all images of a chain, itself included; at most eight."""
    images = {tuple(sequence)}
    for image in (swapped, mirrored, turned):
        images |= {image(each) for each in images}
    return frozenset(images)


def side_of(sequence: Sequence[str]) -> Side:
    """Return the side of the split that a chain belongs to; it depends only on the orbit."""
    digest = hashlib.sha256(" ".join(min(orbit(sequence))).encode()).hexdigest()
    return "test" if int(digest, 16) % TEST_SHARE == 0 else "train"


def refuse_uneven(scene: Scene) -> None:
    """Raise a `SceneError` if a scene distinguishes a chain from one of its images."""
    magnets, casing, pull = scene.magnets, scene.casing, scene.gravity.in_plane
    sizes = ("width", "height", "thickness", "inset", "remanence", "pole_charge")
    given = {f"magnets.{name}": getattr(magnets, name, None) for name in sizes}
    given |= {f"casing.{name}": getattr(casing, name) for name in ("mass", "inertia")}
    wrong = [
        Problem(key, value, "must be one number, because symmetry exchanges what has its own")
        for key, value in given.items()
        if value is not None and len(set(np.ravel(value).tolist())) > 1
    ]
    if scene.field is not None and scene.field.any:
        wrong.append(Problem("field", "a field", "must be left out; it distinguishes N from S"))
    if pull[1] != 0.0:
        wrong.append(Problem("gravity.in_plane", pull, "must have no y; it favours one side"))
    if len({frozenset(_place(each, side) for each in scene.obstacles) for side in (1, -1)}) > 1:
        told = "must lie evenly on both sides of the tube's axis"
        wrong.append(Problem("obstacles", f"{len(scene.obstacles)} obstacles", told))
    refuse(wrong)


def _place(solid: Rectangle, side: int) -> tuple[float, ...]:
    """Return the place, size and heading of an obstacle, or of its mirror image if `side` is −1."""
    (x, y), (length, width) = solid.position, solid.size
    return x, side * y, length, width, (side * solid.heading) % math.pi
