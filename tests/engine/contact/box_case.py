"""Chains whose squares, walls and gaps tests compare with the engine's."""

import numpy as np
from hypothesis import strategies as st

from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.contact import boxes
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Casing, Scene
from magfold_env.simulation.pack import pack
from tests.engine import reference

SIDE = 0.0125
RADIUS = Casing().corner_radius
CORE = (1.0 - boxes.SHRINK) * SIDE / 2 - RADIUS
seeds = st.integers(0, 2**32 - 1)
layouts = st.sampled_from([(7, 0, False), (7, 3, True), (6, 1, True), (6, 0, True)])


class Boxes:
    """A chain of which `lo` components are held in a tube, and the gaps between its boxes."""

    def __init__(self, n, lo=0, *, tube=False):
        scene = Scene(
            sequence=("NNNN",) * n, magnets=None, mount="tube" if tube else "free", friction=0.0
        )
        self.n, self.lo = n, lo
        self.model = pack(scene)
        self.work = new_work(self.model)

    def place(self, q):
        place_all(self.lo, self.model, q, self.work.pose)
        boxes.place_boxes(boxes.first_box(self.lo), self.model, self.work.pose, self.work)

    def polygon(self, box, q):
        """Core of a box (4, 2) from the coordinates alone."""
        if box >= self.n:
            length = 2 * self.n * SIDE * np.sqrt(2)
            radius = min(RADIUS, self.model.wall / 4)
            sign = 1 if box == self.n else -1
            middle = sign * (self.model.bore + self.model.wall) / 2
            half = length / 2 - radius, self.model.wall / 2 - radius
            return reference.rectangle(np.array([-length / 2, middle]), *half)
        if box >= self.lo:
            tail = reference.centres(q[self.lo :], SIDE)
            return reference.square(tail[box - self.lo], q[box], CORE)
        # The outermost held component ends at the base, the next where that begins.
        held = q[box : self.lo]
        along = SIDE * np.sqrt(2) * np.stack([np.cos(held), np.sin(held)], axis=1)
        return reference.square(q[-2:] - along.sum(axis=0) + 0.5 * along[0], q[box], CORE)

    def radii(self, box, other):
        walls = (box >= self.n) + (other >= self.n)
        return (2 - walls) * RADIUS + walls * min(RADIUS, self.model.wall / 4)

    def gap(self, box, other, q):
        """Gap of two boxes whose cores do not overlap."""
        distance = reference.polygon_distance(self.polygon(box, q), self.polygon(other, q))
        return distance - self.radii(box, other)

    def row_gap(self, box, other, k, q):
        """Gap of corner k of `other` from `box`; corners as the engine numbers them."""
        self.place(q)
        work = self.work
        corner = np.array(boxes.corner(work, other, k))
        place = np.array([work.boxes.x[other], work.boxes.y[other]]) + corner
        core = self.polygon(box, q)
        sides = list(zip(core, np.roll(core, -1, axis=0), strict=True))
        away = min(reference.distance_to_segment(place, *ends) for ends in sides)
        # Counter-clockwise: what is inside lies to the left of every side.
        inside = all(np.linalg.det([end - begin, place - begin]) > 0.0 for begin, end in sides)
        return (-away if inside else away) - self.radii(box, other)

    def random_q(self, rng):
        joints = rng.uniform(-np.pi / 2, np.pi / 2, self.n)
        joints[: self.lo] = 0.0
        joints[0] = 0.0 if self.lo else joints[0]
        base = rng.uniform(0.0, 0.01) if self.lo else 0.0
        return np.append(np.cumsum(joints), [base, 0.0])


def pairs(case):
    """All the pairs that the engine looks at."""
    for i in range(boxes.first_box(case.lo), case.n):
        j = boxes.next_partner(case.model, case.lo, i, i)
        while j < case.n + boxes.OBSTACLES:
            yield i, j
            j = boxes.next_partner(case.model, case.lo, i, j)
