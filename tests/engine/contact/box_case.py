"""Chains whose squares, walls and gaps tests compare with the engine's."""

import numpy as np
from hypothesis import strategies as st

from magfold_env.engine.chain.tube import place_all
from magfold_env.engine.contact import boxes
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Casing, Rectangle, Scene
from magfold_env.simulation.pack import pack
from tests.engine import reference

SIDE = 0.0125
RADIUS = Casing().corner_radius
CORE = (1.0 - boxes.SHRINK) * SIDE / 2 - RADIUS
seeds = st.integers(0, 2**32 - 1)
ROCKS = (
    Rectangle(position=(0.05, 0.03), size=(0.004, 0.03), heading=0.7),
    Rectangle(position=(0.07, -0.02), size=(0.012, 0.012), heading=-2.0),
)
layouts = st.sampled_from(
    [
        {"n": 7}, {"n": 7, "lo": 3, "tube": True}, {"n": 6, "lo": 1, "tube": True},
        {"n": 6, "tube": True}, {"n": 6, "obstacles": ROCKS},
        {"n": 6, "lo": 2, "tube": True, "obstacles": ROCKS},
    ]
)  # fmt: skip


class Boxes:
    """A chain with `lo` components held in a tube, and the gaps between its boxes."""

    def __init__(self, n, lo=0, *, tube=False, obstacles=()):
        scene = Scene(
            sequence=("NNNN",) * n, magnets=None, mount="tube" if tube else "free", friction=0.0,
            obstacles=obstacles,
        )  # fmt: skip
        self.n, self.lo, self.scene = n, lo, scene
        self.model = pack(scene)
        self.work = new_work(self.model)

    def place(self, q):
        place_all(self.lo, self.model, q, self.work.pose)
        boxes.place_boxes(boxes.first_box(self.lo), self.model, self.work.pose, self.work)

    def polygon(self, box, q):
        """Return the core of a box, computed from the coordinates."""
        if box >= self.n:
            place, size, heading = self.solid(box)
            return reference.rectangle(place, heading, *(np.array(size) / 2 - self.radius(box)))
        if box >= self.lo:
            tail = reference.centres(q[self.lo :], SIDE)
            return reference.square(tail[box - self.lo], q[box], CORE)
        # The outermost held component ends at the base, the next where that begins.
        held = q[box : self.lo]
        along = SIDE * np.sqrt(2) * np.stack([np.cos(held), np.sin(held)], axis=1)
        return reference.square(q[-2:] - along.sum(axis=0) + 0.5 * along[0], q[box], CORE)

    def solid(self, box):
        """Return place, size and heading of walls, then of obstacles."""
        length, wall, tube = 2 * self.n * SIDE * np.sqrt(2), self.scene.feed.wall, []
        if self.scene.mount == "tube":
            middle = (self.scene.bore + wall) / 2
            tube = [((-length / 2, y), (length, wall), 0.0) for y in (middle, -middle)]
        others = [(each.position, each.size, each.heading) for each in self.scene.obstacles]
        return [*tube, *others][box - self.n]

    def radius(self, box):
        """Return the radius of a box's corners; small obstacles have smaller ones than casings."""
        if box < self.n:
            return RADIUS
        return min(RADIUS, min(self.solid(box)[1]) / 4)

    def radii(self, box, other):
        return self.radius(box) + self.radius(other)

    def gap(self, box, other, q):
        """Return the gap of two boxes whose cores do not overlap."""
        distance = reference.distance(self.polygon(box, q), self.polygon(other, q))
        return distance - self.radii(box, other)

    def row_gap(self, box, other, k, q):
        """Return the gap of corner k (in the engine's order) of `other` from `box`."""
        self.place(q)
        work = self.work
        corner = np.array(boxes.corner(work, other, k))
        place = np.array([work.boxes.x[other], work.boxes.y[other]]) + corner
        core = self.polygon(box, q)
        point = reference.rectangle(place, core.turn[0], 0.0, 0.0)
        return reference.distance(core, point) - self.radii(box, other)

    def random_q(self, rng):
        joints = rng.uniform(-np.pi / 2, np.pi / 2, self.n)
        joints[: self.lo] = 0.0
        joints[0] = 0.0 if self.lo else joints[0]
        base = rng.uniform(0.0, 0.01) if self.lo else 0.0
        return np.append(np.cumsum(joints), [base, 0.0])


def pairs(case):
    """Return all pairs that the engine checks."""
    for i in range(boxes.first_box(case.lo), case.n):
        for j in range(*boxes.partners(case.model, case.lo, i)):
            yield i, j
