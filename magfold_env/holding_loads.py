"""Limit loads: the loads that a fold at rest withstands before it gives way.

Every component is a free body in balance. Magnets, the field and gravity act on it at its pose.
Hinges push and pull, joint stops and contacts only push, and floor friction lies within an
ellipsoid. By the lower-bound theorem of limit analysis, a convex program finds the largest load
that such forces can balance. A fold gives way if and only if the load is larger, because friction
is associated (`magfold_env.engine.friction.law`) and contacts are frictionless.
"""

from __future__ import annotations

import importlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic_core import from_json, to_json

from magfold_env.engine.chain.tube import place_all
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.stepping.dynamics import smooth_accelerations
from magfold_env.engine.workspace import MOST_CONSTRAINED, new_work
from magfold_env.files import write_text
from magfold_env.fold import Fold, FoldStatus, loaded
from magfold_env.reporting.notebook import NotebookDisplay, short_table
from magfold_env.reporting.page import Block
from magfold_env.reporting.tables import Row
from magfold_env.scene import Problem, SceneError, errors
from magfold_env.shapes import BoolArray, FloatArray
from magfold_env.simulation.pack import pack, pack_obstacles
from magfold_env.simulation.simulate import numbers

# Neither package has type annotations.
clarabel: Any = importlib.import_module("clarabel")
sparse: Any = importlib.import_module("scipy.sparse")

AT_REST = (FoldStatus.FOLDED, FoldStatus.MISFOLDED, FoldStatus.HELD)
DIRECTIONS = 24
"""Default number of directions of the pull, evenly spaced."""

# The engine lets casings overlap by `boxes.SHRINK` of the side, so that contacts that only repeat
# stops never act. A contact may then hold a joint at that distance from its stop. Here, both act. A
# joint is at its stop if it is closer than NEAR [rad] to ±90°. Flush faces touch if they are closer
# than NEAR [sides], and other faces if they are closer than TOUCH [sides].
NEAR, TOUCH = 3.0 * boxes.SHRINK, boxes.SHRINK + jacobian.TOUCH
FLUSH = 1e-3  # largest angle between flush faces [rad]
STEP = 5e-4  # step of the differences for stiffnesses [rad]
UNBALANCED = 1e-5  # allowed residual in a fold at rest, relative to the largest force
EXACT = 1e-10  # tolerance of the solver, in units of the largest force and of the casing's side
LARGEST = 1e6  # largest finite load, in the same units
FOUND, BOUNDLESS = ("Solved", "AlmostSolved"), ("DualInfeasible", "AlmostDualInfeasible")


@dataclass(frozen=True, eq=False)
class Holding(NotebookDisplay):
    """The loads that a fold at rest withstands.

    The fold gives way when forces cannot balance at its present pose. The motion that follows is
    not computed. A load that the fold withstands at any size is `inf`.
    """

    fold: Fold
    """The fold at rest."""
    opening: FloatArray
    """Moments that turn joint k to the left and to the right [N·m], shape (n-1, 2). The load is +M
    on component k+1 and −M on component k, or the reverse."""
    stiffness: FloatArray
    """Stiffness of each joint [N·m/rad], shape (n-1,): the increase per radian of the moment with
    which the magnets, the field and gravity turn the joint back, with all other joints fixed. At a
    stop, it is the slope in the direction that opens the joint. A joint with a negative stiffness
    snaps open when it gives way."""
    directions: FloatArray
    """Directions of the pull in the plane [rad], shape (m,); 0 is along +x, the direction of a
    tube."""
    pull: FloatArray
    """Force on the centre of component `pulled` at which the fold gives way [N], shape (m,)."""
    pulled: int
    """Number of the pulled component, from 1."""
    held: int
    """Number of the component whose place and heading are held against the pull; 0 if only the
    mount and the floor hold the chain."""

    @cached_property
    def opens(self) -> FloatArray:
        """The smaller of the two moments of each joint [N·m], shape (n-1,)."""
        return self.opening.min(axis=1)

    @cached_property
    def least_pull(self) -> tuple[float, float]:
        """The smallest pull [N] and its direction [rad]."""
        least = int(np.argmin(self.pull))
        return float(self.pull[least]), float(self.directions[least])

    @cached_property
    def from_front(self) -> FloatArray:
        """The directions of the pull in the frame of the pulled component [rad], shape (m,).

        0 points to its front hinge, which joins the next component; positive angles turn left.
        """
        turned = self.directions - self.fold.angles[self.pulled - 1]
        return (turned + math.pi) % (2.0 * math.pi) - math.pi

    def __str__(self) -> str:
        """Return the weakest joint and the least pull as text."""
        words: list[str] = []
        if np.isfinite(self.opens).any():
            joint = int(np.argmin(self.opens))
            words.append(f"joint {joint + 1} opens at {1e3 * self.opens[joint]:.3g} mN·m")
        force, direction = self.least_pull
        by = f"component {self.held} held" if self.held else "the mount and the floor hold"
        turned = math.degrees(self.from_front[int(np.argmin(self.pull))])
        aside = f"{abs(turned):.0f}° {'left' if turned > 0 else 'right'} of its front"
        towards = f"at {force:.3g} N towards {math.degrees(direction):.0f}°, {aside}"
        where = towards if math.isfinite(force) else "at no pull"
        words.append(f"component {self.pulled} gives way {where} ({by})")
        return "; ".join(words)

    def _shown(self) -> list[Block]:
        columns = self.fold.word, *(1e3 * self.opening.T), 1e3 * self.stiffness
        names = "joint", "letter", "left [mN·m]", "right [mN·m]", "stiffness [mN·m/rad]"
        values = zip(range(1, len(self.fold.angles)), *columns, strict=True)
        rows: Iterator[Row] = (dict(zip(names, each, strict=True)) for each in values)
        table = short_table("Moments that open the joints", rows, len(self.fold.word))
        return [f"{self}.", *self.fold.scene.pictured(self.fold.angles), table]

    def to_dict(self) -> dict[str, Any]:
        """Return all values as JSON values, in which infinite numbers become None."""
        data = {name: value for name, value in vars(self).items() if name in self._NAMES}
        found = from_json(to_json(data, inf_nan_mode="null", fallback=np.ndarray.tolist))
        return {**found, "fold": self.fold.to_dict()}

    def to_json(self, path: str | Path) -> None:
        """Write the values of `to_dict` to a file, through a temporary file."""
        write_text(path, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")

    _NAMES = ("opening", "stiffness", "directions", "pull", "pulled", "held")


def holding(
    fold: Fold,
    *,
    directions: npt.ArrayLike | None = None,
    pulled: int | None = None,
    held: int | None = None,
) -> Holding:
    """Return the moments that open a fold's joints, and the pull at which it gives way.

    The scene's mount acts: a pin holds component 1's outer hinge, and a tube holds the components
    in it. Friction with the floor acts on all other components, including the pulled one.

    Parameters
    ----------
    fold
        A fold at rest; see `Fold.status`.
    directions
        Directions of the pull [rad], shape (m,); by default `DIRECTIONS` evenly spaced ones.
    pulled
        Number of the component that is pulled at its centre. The default is component 1, or
        component n if the mount holds component 1.
    held
        Number of the component that is held in its pose; 0 for none. The default is the end of the
        chain that is not pulled, or none if the tube holds that end.

    Raises
    ------
    SceneError
        If the fold is not at rest, if the forces on it are not balanced, or if an argument is not
        allowed.
    """
    errors.refuse(errors.unless_a("fold", fold, Fold, "a Fold, as simulate returns one"))
    problems = errors.unless_one_of("fold.status", fold.status.value, [s.value for s in AT_REST])
    if fold.scene.n > MOST_CONSTRAINED:
        allowed = f"must have at most {MOST_CONSTRAINED} components"
        problems.append(Problem("fold.scene.n", fold.scene.n, allowed))
    errors.refuse(problems)
    n, fixed = fold.scene.n, in_tube(fold)
    mounted = bool(fixed[0]) or fold.scene.mount == "pinned"
    if pulled is None:
        pulled = n if mounted else 1
    errors.refuse(errors.unless_whole("pulled", pulled, 1, n))
    if held is None:
        end = 1 if pulled == n else n
        held = 0 if n == 1 or fixed[end - 1] else end
    if directions is None:
        directions = np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS)
    angles = numbers(directions)
    if angles is None or angles.ndim != 1 or not angles.size or not np.isfinite(angles).all():
        allowed = "must be finite numbers, one a direction"
        raise SceneError([Problem("directions", directions, allowed)])
    if errors.unless_whole("held", held, 0, n) or held == pulled:
        allowed = f"must be from 1 to {n} and not the one that is pulled, or 0 for none"
        raise SceneError([Problem("held", held, allowed)])
    forces = _Forces(fold)
    balance, opening = _Balance(fold, forces, fixed), np.empty((n - 1, 2))
    for joint in range(n - 1):
        couple = _wrench(n, {joint: (0.0, 0.0, -1.0), joint + 1: (0.0, 0.0, 1.0)})
        opening[joint] = balance.limit(couple), balance.limit(-couple)
    if held:
        balance = _Balance(fold, forces, fixed | (np.arange(n) == held - 1))
    pull = [
        balance.limit(_wrench(n, {pulled - 1: (math.cos(angle), math.sin(angle), 0.0)}))
        for angle in angles
    ]
    stiffness = _stiffnesses(forces, fold, from_first=not fixed[-1])
    return Holding(fold, opening, stiffness, angles, np.array(pull), pulled, held)


def in_tube(fold: Fold) -> BoolArray:
    """Return which components the tube holds at a fold's end, component 1 first, shape (n,)."""
    numbers = np.arange(fold.scene.n)
    if fold.scene.feed.direction == "backward":
        return numbers < fold.in_tube
    return numbers >= fold.scene.n - fold.in_tube


# --- loads of the components -----------------------------------------------------------------


class _Forces:
    """Forces of magnets, field and gravity on a fold's components, as the engine computes them."""

    def __init__(self, fold: Fold) -> None:
        n = fold.scene.n
        # With this mount, the engine does not reverse the chain, and walls do not move.
        model = pack(fold.scene.model_copy(update={"mount": "free"}))
        acts = loaded(fold.scene, fold.angles[None], fold.base[None], [n - fold.in_tube])[0]
        model.charge[~acts] = 0.0
        self.friction_limit = model.friction_limit
        """Largest friction force on each component [N], shape (n,)."""
        self.model = model._replace(obstacles=pack_obstacles(fold.scene), frictional=False)
        self.work = new_work(self.model)

    def at(self, angles: FloatArray, base: FloatArray) -> FloatArray:
        """Return forces (x, y) [N] and torques about centres [N·m] at a pose, shape (n, 3)."""
        n, work = self.model.n, self.work
        q = np.concatenate([angles, base])
        smooth_accelerations(0, self.model, q, np.zeros(n + 2), work, np.empty(n + 2))
        return np.stack([work.loads.fx, work.loads.fy, work.loads.torque], axis=1)

    @property
    def centres(self) -> FloatArray:
        """The centres at the last pose [m], shape (n, 2)."""
        return np.stack([self.work.pose.x, self.work.pose.y], axis=1)

    @property
    def reach(self) -> FloatArray:
        """Vectors from each centre to the hinge farther along the chain [m], shape (n, 2)."""
        cosines, sines = self.work.pose.cos, self.work.pose.sin
        return self.model.bodies.reach[:, None] * np.stack([cosines, sines], axis=1)


def _stiffnesses(forces: _Forces, fold: Fold, *, from_first: bool) -> FloatArray:
    """Return the stiffness of each joint in a fold [N·m/rad], shape (n-1,).

    A joint turns the components after it if ``from_first``, else those before it.
    """
    found = np.empty(fold.scene.n - 1)
    for joint, angle in enumerate(fold.joint_angles):
        if _at_stop(fold, angle):
            # From the stop: a one-sided difference of second order.
            step = -math.copysign(STEP, angle)
            turns, weights = (0.0, step, 2.0 * step), np.array([-1.5, 2.0, -0.5]) / step
        else:
            turns, weights = (-STEP, STEP), np.array([-0.5, 0.5]) / STEP
        moments = [_moment(forces, fold, joint, turn, from_first) for turn in turns]
        found[joint] = -float(weights @ moments)
    return found


def _moment(forces: _Forces, fold: Fold, joint: int, turn: float, from_first: bool) -> float:
    """Return the moment on a joint [N·m], positive to the left, after a turn of ``turn`` [rad]."""
    beyond = np.arange(fold.scene.n) > joint
    angles = fold.angles + (np.where(beyond, turn, 0.0) if from_first else beyond * turn - turn)
    # The shift keeps the joint's hinge in place.
    gone = np.exp(1j * fold.angles[: joint + 1]) - np.exp(1j * angles[: joint + 1])
    shift = fold.scene.casing.diagonal * complex(gone.sum())
    force = forces.at(angles, fold.base + np.array([shift.real, shift.imag]))
    arm = forces.centres - (forces.centres + forces.reach)[joint]
    moments = force[:, 2] + _cross(arm, force[:, :2])
    return float(moments[beyond].sum() if from_first else -moments[~beyond].sum())


def _cross(arm: FloatArray, force: FloatArray) -> FloatArray:
    """Return the torques (...) of forces (..., 2) at the ends of arms (..., 2)."""
    return arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0]


# --- balance and the largest load ------------------------------------------------------------


class _Balance:
    """The balance of forces and torques on all movable components.

    A *wrench*, shape (n, 3), contains the forces and the torques about the centres that a unit of
    one unknown exerts on the components. The unknowns are hinge forces, then forces that can only
    push, then friction. Forces are in units of the largest force, and lengths in sides.
    """

    def __init__(self, fold: Fold, forces: _Forces, fixed: BoolArray) -> None:
        acting = forces.at(fold.angles, fold.base)
        self._moves, self._lengths = ~fixed, np.array([1.0, 1.0, fold.scene.casing.side])
        largest = float(max(np.abs(acting / self._lengths).max(), forces.friction_limit.max()))
        self._unit = largest if largest > 0.0 else 1.0
        either_way = _hinge_wrenches(forces, pinned=fold.scene.mount == "pinned")
        pushing = [*_stop_wrenches(fold), *_contact_wrenches(fold, forces)]
        rubs = np.flatnonzero(self._moves & (forces.friction_limit > 0.0))
        # Friction along x, along y and about the centre.
        units = np.diag([1.0, 1.0, forces.model.friction_radius]).tolist()
        rubbing = [_wrench(fold.scene.n, {i: unit}) for i in rubs.tolist() for unit in units]
        columns = [self._scaled(wrench) for wrench in (*either_way, *pushing, *rubbing)]
        self._size, self._grip = (
            3 * int(self._moves.sum()),
            forces.friction_limit[rubs] / self._unit,
        )
        self._pushing = len(either_way) + np.arange(len(pushing))
        self._rubbing = len(either_way) + len(pushing) + np.arange(3 * len(rubs))
        self._cones = [
            clarabel.ZeroConeT(self._size),
            clarabel.NonnegativeConeT(len(pushing)),
            *[clarabel.SecondOrderConeT(4)] * len(rubs),
        ]
        # The rows are the balance, then pushes, then each component's friction limit and friction.
        below = self._size + len(pushing)
        matrix = np.zeros((below + 4 * len(rubs), len(columns)))
        matrix[: self._size] = np.array(columns).reshape(-1, self._size).T
        matrix[self._size + np.arange(len(pushing)), self._pushing] = -1.0
        rub = np.arange(3 * len(rubs))
        matrix[below + 4 * (rub // 3) + 1 + rub % 3, self._rubbing] = -1.0
        self._matrix, self._right = sparse.csc_matrix(matrix), np.zeros(len(matrix))
        self._right[: self._size] = -self._scaled(acting) / self._unit
        self._right[below::4] = self._grip
        if largest > 0.0:
            self._make_exact()

    def _scaled(self, wrench: FloatArray) -> FloatArray:
        return (wrench / self._lengths)[self._moves].ravel()

    def _make_exact(self) -> None:
        """Remove the unbalanced part of the fold's loads; refuse a fold where it is large."""
        size = self._size
        found = self._solve(-np.eye(size), np.ones(size), np.zeros(size))
        assert found is not None  # the added unknowns can fill any gap
        found = found[size:]
        found[self._pushing] = np.maximum(found[self._pushing], 0.0)
        friction = found[self._rubbing].reshape(-1, 3)
        sizes = np.maximum(np.linalg.norm(friction, axis=1), self._grip)
        found[self._rubbing] = (friction * (self._grip / sizes)[:, None]).ravel()
        balanced = (self._matrix @ found)[:size]
        gap = float(np.abs(balanced - self._right[:size]).max(initial=0.0))
        if gap > UNBALANCED:
            allowed = "must be 0 at rest; it is the largest unbalanced force [N]"
            errors.refuse([Problem("fold", gap * self._unit, allowed)])
        self._right[:size] = balanced

    def limit(self, load: FloatArray) -> float:
        """Return the largest multiple of a wrench that can be balanced, or `inf` if all can."""
        column = self._scaled(load)[:, None]
        size = float(np.abs(column).max(initial=0.0))
        if size == 0.0:
            return math.inf
        found = self._solve(column / size, np.zeros(1), -np.ones(1))
        if found is None or found[0] > LARGEST:
            return math.inf
        return max(float(found[0]), 0.0) * self._unit / size

    def _solve(
        self, added: FloatArray, quadratic: FloatArray, linear: FloatArray
    ) -> FloatArray | None:
        """Minimise x² · quadratic / 2 + x · linear, in balance if ``added`` (size, k) @ x is added.

        Returns x (k) and then the unknowns at the minimum, or None if there is no minimum.
        """
        below = np.zeros((len(self._right) - self._size, len(linear)))
        none = np.zeros(self._matrix.shape[1])
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_feas = settings.tol_gap_abs = settings.tol_gap_rel = EXACT
        solution = clarabel.DefaultSolver(
            sparse.diags(np.concatenate([quadratic, none]), format="csc"),
            np.concatenate([linear, none]),
            sparse.hstack([np.concatenate([added, below]), self._matrix], format="csc"),
            self._right,
            self._cones,
            settings,
        ).solve()
        status = str(solution.status)
        if status in BOUNDLESS:
            return None
        if status not in FOUND:
            raise ArithmeticError(f"no limit load was found: {status}")
        return np.array(solution.x)


def _wrench(n: int, rows: Mapping[int, Sequence[Any]]) -> FloatArray:
    """Return a wrench (n, 3) with the given rows by component index, and zeros elsewhere."""
    wrench = np.zeros((n, 3))
    for k, row in rows.items():
        wrench[k] = row
    return wrench


def _hinge_wrenches(forces: _Forces, *, pinned: bool) -> list[FloatArray]:
    """Return the wrenches of hinge forces along x and y; each acts on both hinged components."""
    n, reach = forces.model.n, forces.reach
    found: list[FloatArray] = []
    for hinge in range(-1 if pinned else 0, n - 1):
        for axis in np.eye(2):
            rows = {hinge + 1: (*-axis, _cross(reach[hinge + 1], axis))}
            if hinge >= 0:
                rows[hinge] = *axis, _cross(reach[hinge], axis)
            found.append(_wrench(n, rows))
    return found


def _stop_wrenches(fold: Fold) -> list[FloatArray]:
    """Return the wrenches of stops, which push their joints open."""
    found: list[FloatArray] = []
    for joint, angle in enumerate(fold.joint_angles):
        if _at_stop(fold, angle):
            way = math.copysign(1.0, angle)
            rows = {joint: (0.0, 0.0, way), joint + 1: (0.0, 0.0, -way)}
            found.append(_wrench(fold.scene.n, rows))
    return found


def _at_stop(fold: Fold, angle: float) -> bool:
    return fold.scene.contact and abs(angle) > 0.5 * math.pi - NEAR


def _contact_wrenches(fold: Fold, forces: _Forces) -> list[FloatArray]:
    """Return the wrenches of touching casings and obstacles, which push them apart.

    The contacts are those that the engine finds for slightly enlarged casings.
    """
    if not fold.scene.contact:
        return []
    n, work, model = fold.scene.n, forces.work, forces.model
    near = NEAR * model.side
    large = model._replace(
        side=model.side + 2.0 * near / (1.0 - boxes.SHRINK), rounding=model.rounding + near
    )
    place_all(0, large, np.concatenate([fold.angles, fold.base]), work.pose)
    boxes.place_boxes(0, large, work.pose, work)
    count = int(jacobian.collect_contacts(0, large, work, 0, jacobian.TOUCH * large.side))
    if count < 0:
        raise ValueError("fold: has more contacts than the engine can store")
    found: list[FloatArray] = []
    for box, other, corner in work.rows.id[:count, :3].tolist():
        ux, uy, distance, _ = boxes.corner_offset(work, box, other, corner)
        c, s = work.boxes.c[box], work.boxes.s[box]
        cos = c * work.boxes.c[other] + s * work.boxes.s[other]
        sin = c * work.boxes.s[other] - s * work.boxes.c[other]
        flush = abs(cos * sin) < FLUSH
        gap = distance - boxes.clearance(model, box, other)
        if gap > (NEAR if flush else TOUCH) * model.side:
            continue
        # A corner just beyond the end of a flush face is pushed like a corner on the face.
        if flush and min(abs(ux), abs(uy)) * distance < near:
            ux, uy = (round(ux), 0.0) if abs(ux) > abs(uy) else (0.0, round(uy))
        normal = np.array([c * ux - s * uy, s * ux + c * uy])
        arm = np.array(boxes.corner(work, other, corner))
        centre = np.stack([work.boxes.x, work.boxes.y], axis=1)
        rows = {
            other: (*normal, _cross(arm, normal)),
            box: (*-normal, -_cross(centre[other] + arm - centre[box], normal)),
        }
        found.append(_wrench(n, {k: row for k, row in rows.items() if k < n}))
    return found
