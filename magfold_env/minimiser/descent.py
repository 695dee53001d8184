"""Local descent of the energy over continuous joint angles: `descend`.

Springs push overlapping casings apart; their energy counts like the magnets'.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magfold_env import shapes
from magfold_env.engine.magnets import pairs
from magfold_env.engine.state import Array, Loads, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.minimiser.energies import energy_unit, refuse_field
from magfold_env.scene import Scene, errors
from magfold_env.simulation.pack import charges, pack_magnets
from magfold_env.simulation.simulate import checked

STIFFNESS: Final = 2e4
"""Stiffness of the springs between casings in energy units per side²: overlaps stay below 1e-3
side."""
TOLERANCE: Final = 1e-6
"""Torques on free joints below this part of the energy unit count as zero."""
APART = 4
"""Components closer along the chain cannot overlap while the stops between them hold."""

_LONGEST_STEP = 0.1  # of a joint [rad]
_SHORTEST_SHARE = 1e-12  # factor by which a step is shortened
_SUFFICIENT = 1e-4  # share of the slope that a step must realise
_DIFFERENCE = 1e-6  # of a joint, for second derivatives [rad]
_FLATTEST = 1e-6  # least curvature that a step trusts, relative to the largest

_CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


@dataclass(frozen=True, eq=False)
class Descent:
    """The result of `descend`."""

    angles: Array
    """Headings [rad], shape (n,); that of component 1 is unchanged."""
    word: str
    """The nearest letters."""
    energy: float
    """`mf.energy` at the angles [J]."""
    torques: Array
    """Torques of the magnets on the joints, -∂U/∂θ [N·m], shape (n-1,); in a chain at rest they are
    zero or balanced by stops or touching casings."""
    overlap: float
    """Largest overlap of casings that press on each other [m]."""
    steps: int
    """Number of steps taken."""
    converged: bool
    """Whether no torque turns a free joint any more."""


def descend(scene: Scene, angles: ArrayLike, *, max_steps: int = 500) -> Descent:
    """Follow the magnetic energy downhill from any state to a local minimum.

    Joints stay within their stops. Stiff springs push apart overlapping casings that are four or
    more places apart. Casings that are pressed together therefore keep a small overlap, which the
    result reports; overlaps of the initial state are removed first. Without `contact` in the scene
    there are neither stops nor springs. There is no inertia and no friction. A state in which no
    torque turns a joint does not change, even on a ridge.

    Parameters
    ----------
    scene
        Its sequence, casing, magnets and contact count.
    angles : (n,) array
        Initial headings [rad]; joints beyond their stops are set to them.
    max_steps
        Largest number of steps.

    Raises
    ------
    SceneError
        If the angles do not fit.
    ValueError
        If `max_steps` is below 1, or the scene has an external field.

    Notes
    -----
    The method takes projected Newton steps (Bertsekas, SIAM J. Control Optim. 20, 1982). Second
    derivatives are differences of the torques, and curvatures enter by their magnitudes, so that a
    step also goes down from a ridge.
    """
    start = checked("angles", angles, scene)
    errors.refuse(errors.unless_whole("max_steps", max_steps, 1))
    refuse_field(scene)
    potential, side = _Potential(scene, float(start[0])), scene.casing.side
    limit = 0.5 * np.pi if scene.contact else np.inf
    joints = np.clip(np.diff(start), -limit, limit)
    energy, torques = potential.at(joints)
    enough = TOLERANCE * max(energy_unit(scene), np.finfo(np.float64).tiny)
    steps, converged = 0, False
    while not converged and steps < max_steps:
        held = ((joints >= limit) & (torques > 0.0)) | ((joints <= -limit) & (torques < 0.0))
        free = np.flatnonzero(~held)
        if not free.size or np.abs(torques[free]).max() <= enough:
            converged = True
            break
        step = _step(potential, joints, torques, limit)
        moved = _line_search(potential, joints, energy, torques, step, limit)
        if moved is None:
            break
        joints, energy, torques = moved
        steps += 1
    headings, places = potential.place(joints)
    energy, torques = potential.at(joints, springs=False)
    return Descent(
        angles=headings,
        word=shapes.angles_to_word(joints),
        energy=energy,
        torques=torques,
        overlap=max((each.depth for each in overlaps(places, headings, side)), default=0.0),
        steps=steps,
        converged=converged,
    )


class _Potential:
    """The energy of a chain by its joint angles, including the springs between casings."""

    def __init__(self, scene: Scene, first: float) -> None:
        pinned = scene.alone()
        self._scene = pinned
        self._first = first
        self._magnets = pack_magnets(pinned)
        self._charge = charges(pinned)
        self._nodes = new_nodes(self._magnets, pinned.n)
        self._stiffness = STIFFNESS * energy_unit(scene) / scene.casing.side**2

    def at(
        self, joints: Array, *, springs: bool = True, with_energy: bool = True
    ) -> tuple[float, Array]:
        """Return the energy [J] and the torques on the joints (n-1,) [N·m].

        The torques without the magnetic energy take half the time.
        """
        headings, places = self.place(joints)
        energy, force, moment = self._magnetic(headings, places, with_energy=with_energy)
        if springs and self._scene.contact:
            found = overlaps(places, headings, self._scene.casing.side)
            energy += push(found, self._stiffness, force, moment)
        # Moments about each hinge of the forces on the components behind it.
        half = 0.5 * self._scene.casing.diagonal
        hinges = places - half * np.stack([np.cos(headings), np.sin(headings)], axis=1)
        beyond = np.cumsum(force[::-1], axis=0)[::-1]
        turning = np.cumsum(moment[::-1])[::-1]
        return energy, (turning - hinges[:, 0] * beyond[:, 1] + hinges[:, 1] * beyond[:, 0])[1:]

    def place(self, joints: Array) -> tuple[Array, Array]:
        """Return headings (n,) [rad] and centres (n, 2) [m]."""
        headings = shapes.headings(joints, self._first)
        return headings, shapes.centres(headings, self._scene.casing.side)

    def _magnetic(
        self, headings: Array, places: Array, *, with_energy: bool
    ) -> tuple[float, Array, Array]:
        """Energy [J], forces (n, 2) [N] and moments about the origin (n,) [N·m] of the magnets."""
        n = len(headings)
        force, moment = np.zeros((n, 2)), np.zeros(n)
        if self._scene.magnets is None:
            return 0.0, force, moment
        x, y = np.ascontiguousarray(places.T)
        pose = Pose(np.cos(headings), np.sin(headings), x, y)
        force_x, force_y = np.zeros(n), np.zeros(n)
        loads = Loads(force_x, force_y, moment)
        pairs.add_forces(0, self._magnets, self._charge, pose, self._nodes, loads)
        energy = 0.0
        if with_energy:
            energy = float(pairs.energy(0, self._magnets, self._charge, pose, self._nodes))
        force[:, 0], force[:, 1] = force_x, force_y
        moment += x * force_y - y * force_x
        return energy, force, moment


def _step(potential: _Potential, joints: Array, torques: Array, limit: float) -> Array:
    """Return a step downhill (n-1,) [rad].

    Joints that are driven towards a nearby stop move to it; the step of the others leads to the
    minimum of a quadratic form. If all joints took the latter step, cutting it short at stops could
    make it lead uphill.
    """
    room = np.where(torques > 0.0, limit - joints, -limit - joints)
    stopping = np.abs(room) < _LONGEST_STEP
    step = np.where(stopping, room, 0.0)
    rest = np.flatnonzero(~stopping)
    if rest.size:
        step[rest] = _newton_step(potential, joints, torques, rest)
    return step


def _newton_step(
    potential: _Potential, joints: Array, torques: Array, free: NDArray[np.intp]
) -> Array:
    """Return the step of the free joints to the minimum of their quadratic form [rad]."""
    curvature = np.empty((free.size, free.size))
    for k, joint in enumerate(free):
        moved = joints.copy()
        moved[joint] += _DIFFERENCE
        there = potential.at(moved, with_energy=False)[1]
        curvature[k] = (torques[free] - there[free]) / _DIFFERENCE
    values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
    size = np.abs(values)
    size = np.maximum(size, max(_FLATTEST * size.max(), np.finfo(np.float64).tiny))
    step = vectors @ ((vectors.T @ torques[free]) / size)
    return step * min(1.0, _LONGEST_STEP / np.abs(step).max(initial=_LONGEST_STEP))


def _line_search(
    potential: _Potential, joints: Array, energy: float, torques: Array, step: Array, limit: float
) -> tuple[Array, float, Array] | None:
    """Shorten a step until the energy falls enough; return None if it never falls."""
    share = 1.0
    while share > _SHORTEST_SHARE:
        moved = np.clip(joints + share * step, -limit, limit)
        lower, turned = potential.at(moved)
        if lower <= energy - _SUFFICIENT * float(torques @ (moved - joints)) and lower < energy:
            return moved, lower, turned
        share *= 0.5
    return None


class Overlap(NamedTuple):
    """A corner of one casing behind a face of another."""

    first: int
    """The casing with the face, 0-based."""
    second: int
    """The casing with the corner."""
    depth: float
    """Depth of the corner behind the face [m]."""
    normal: Array
    """Normal of the face towards the second casing, shape (2,)."""
    corner: Array
    """Place of the corner [m], shape (2,)."""


def overlaps(centres: Array, headings: Array, side: float) -> list[Overlap]:
    """Return the corners of overlapping casings that have passed a face.

    Two squares are apart if a face of one of them separates them. Otherwise the face that comes
    closest to separating them is pushed, together with all corners behind it: flush squares press
    on each other with two corners. ``centres`` (n, 2) and ``side`` are in metres, ``headings`` (n,)
    in radians.
    """
    found: list[Overlap] = []
    distance = np.hypot(*(centres[:, None] - centres[None, :]).transpose(2, 0, 1))
    for i, j in np.argwhere(np.triu(distance < np.sqrt(2.0) * side, APART)).tolist():
        candidates = [
            _behind_face(a, b, centres, headings, 0.5 * side) for a, b in ((i, j), (j, i))
        ]
        least = min(candidates, key=lambda corners: max(corner.depth for corner in corners))
        if all(any(corner.depth > 0.0 for corner in corners) for corners in candidates):
            found += [corner for corner in least if corner.depth > 0.0]
    return found


def push(found: list[Overlap], stiffness: float, force: Array, moment: Array) -> float:
    """Add the forces (n, 2) [N] that push overlapping casings apart, and their moments (n,) [N·m].

    ``stiffness`` is the force by depth [N/m]; moments are about the origin. Returns the
    corresponding energy, half of stiffness times depth² for each corner [J].
    """
    for first, second, depth, normal, corner in found:
        strength = stiffness * depth * normal
        turning = corner[0] * strength[1] - corner[1] * strength[0]
        force[second] += strength
        force[first] -= strength
        moment[second] += turning
        moment[first] -= turning
    return 0.5 * stiffness * sum(overlap.depth**2 for overlap in found)


def _behind_face(a: int, b: int, centres: Array, headings: Array, half: float) -> list[Overlap]:
    """Return the depths of b's corners behind the face of a that nearly separates them."""
    axes, others = _axes(headings[a]), _axes(headings[b])
    gap = axes @ (centres[b] - centres[a])
    k = int(np.argmin(half * np.abs(axes @ others.T).sum(axis=1) - np.abs(gap)))
    normal = axes[k] if gap[k] >= 0.0 else -axes[k]
    corners = centres[b] + half * _CORNERS @ others
    depths = half - (corners - centres[a]) @ normal
    return [
        Overlap(a, b, float(depth), normal, corner)
        for depth, corner in zip(depths, corners, strict=True)
    ]


def _axes(heading: float) -> Array:
    """Return two normals of a casing's faces, one per row."""
    cos, sin = np.cos(heading + 0.25 * np.pi), np.sin(heading + 0.25 * np.pi)
    return np.array([[cos, sin], [-sin, cos]])
