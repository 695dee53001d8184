"""Allocate what the kernels work on."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from magfold_env.engine.chain import recursion
from magfold_env.engine.contact.boxes import OBSTACLES
from magfold_env.engine.magnets.expansions import SCRATCH, TERMS
from magfold_env.engine.magnets.lookup import DEGREE, PAIRS
from magfold_env.engine.magnets.multipoles import PAIR_PARTS, PARTS
from magfold_env.engine.magnets.segments import BATCH, LONG
from magfold_env.engine.state import (
    BRAKE,
    FRESH,
    LO,
    STEP,
    Array,
    IntArray,
    Magnets,
    Model,
    Newton,
    Nodes,
    Pose,
    Record,
    Rigid,
    Segments,
    State,
    Work,
)
from magfold_env.engine.stepping.dormand_prince import STAGES

# Constraints are solved densely; longer chains must do without contact and friction.
MOST_CONSTRAINED = 500
# Stops between the ends of a rigid part are kept as one integer to base 3.
MOST_SPANS = 39


def new_state(model: Model, angles: Array) -> State:
    """Return a chain at rest with the given headings (n,) and its inner end at the origin.

    With a tube all of it is inside, the outer tip at the mouth.
    """
    n = model.n
    q = np.zeros(n + 2)
    q[:n] = angles
    clock = np.zeros(7)
    clock[BRAKE] = math.inf
    clock[STEP] = 0.1 / model.light_rate
    count: IntArray = np.zeros(9, dtype=np.int64)
    count[LO] = n if model.tube else 0
    count[FRESH] = 1
    return State(
        q=q,
        v=np.zeros(n + 2),
        lock=np.zeros(n, dtype=np.int64),
        stuck=np.zeros(n, dtype=np.int64),
        counter=count,
        clock=clock,
    )


def new_work(model: Model) -> Work:
    """Scratch space for one chain."""
    n = model.n
    rows = 1
    if model.contact or model.frictional:
        if n > MOST_CONSTRAINED:
            msg = (
                f"sequence: {n} components are too many with contact or friction; "
                f"at most {MOST_CONSTRAINED} (without both: any number)"
            )
            raise ValueError(msg)
        rows = 6 * n + 16

    def floats(*shape: int) -> Array:
        return np.zeros(shape)

    def integers(*shape: int) -> IntArray:
        return np.zeros(shape, dtype=np.int64)

    return Work(
        pose=Pose(floats(n), floats(n), floats(n), floats(n)),
        nodes=new_nodes(model.magnets, n) if model.magnetic else NO_NODES,
        rigid=new_rigid(model.magnets, n) if model.magnetic else NO_RIGID,
        fx=floats(n),
        fy=floats(n),
        torque=floats(n),
        vx=floats(n),
        vy=floats(n),
        ax=floats(n),
        ay=floats(n),
        art=floats(n, 7),
        sweep=floats(recursion.ROWS, n),
        hold=floats(n),
        open=integers(n),
        force=floats(n + 2),
        smooth=floats(n + 2),
        stage_q=floats(n + 2),
        stage_v=floats(n + 2),
        new_q=floats(n + 2),
        new_v=floats(n + 2),
        slope_q=floats(STAGES, n + 2),
        slope_v=floats(STAGES, n + 2),
        box_x=floats(n + OBSTACLES),
        box_y=floats(n + OBSTACLES),
        box_c=floats(n + OBSTACLES),
        box_s=floats(n + OBSTACLES),
        box_a=floats(n + OBSTACLES),
        box_b=floats(n + OBSTACLES),
        row_count=integers(4),
        row_id=integers(rows, 4),
        jacobian=floats(rows, n + 2),
        response=floats(rows, n + 2),
        delassus=floats(rows, rows),
        bias=floats(rows),
        gap=floats(rows),
        multiplier=floats(rows),
        passive=integers(rows),
        equality=integers(rows),
        order=integers(rows),
        mark=integers(n),
        braking=floats(n),
        slow=integers(n),
        trial=floats(rows),
        update=floats(rows),
        cholesky=floats(rows, rows),
        newton=new_newton(rows, n) if rows > 1 else NO_NEWTON,
    )


def new_newton(rows: int, n: int) -> Newton:
    """Scratch space to solve for friction."""
    return Newton(
        factor=np.zeros((rows, n + 2)),
        hessian=np.zeros((n + 2, n + 2)),
        point=np.zeros(n + 2),
        gradient=np.zeros(n + 2),
        step=np.zeros(n + 2),
        scale=np.zeros(rows),
        offset=np.zeros(rows),
        rate=np.zeros(rows),
        force=np.zeros(rows),
        projected=np.zeros(rows),
        normal=np.zeros(rows),
        along=np.zeros(rows),
    )


def new_nodes(magnets: Magnets, n: int) -> Nodes:
    """Scratch space for the sums over n casings."""
    most = 8 * int(magnets.rank_count.max())
    # Sums over levels need room too.
    lanes = max(most, magnets.level_node.shape[1])
    return _nodes((magnets.rank_count.size, n, most), lanes)


def _nodes(shape: tuple[int, int, int], lanes: int) -> Nodes:
    n = shape[1]
    return Nodes(
        faces=np.zeros(n, dtype=np.int64),
        along=np.zeros(shape),
        across=np.zeros(shape),
        x=np.zeros(shape),
        y=np.zeros(shape),
        q=np.zeros(shape),
        half=np.zeros(shape),
        body=np.zeros((n, 2, len(TERMS))),
        moment=np.zeros((n, 2, len(TERMS))),
        expanded=np.zeros(SCRATCH),
        segments=new_segments(n),
        lane_x=np.zeros(lanes),
        lane_y=np.zeros(lanes),
        lane_u=np.zeros(lanes),
        spline=np.zeros((4, DEGREE + 1)),
        row=np.zeros((DEGREE + 1) * PAIRS),
    )


def new_segments(n: int) -> Segments:
    """Scratch space for the segments of n components."""
    levels = 1 + (n - 1).bit_length() if n >= LONG else 1
    rows = [-(-n // 2**level) for level in range(levels)]
    total = sum(rows)
    return Segments(
        start=np.cumsum([0, *rows[:-1]], dtype=np.int64),
        charged=np.zeros(total, dtype=np.int64),
        x=np.zeros(total),
        y=np.zeros(total),
        body=np.zeros((n, PARTS)),
        moment=np.zeros((total, PARTS)),
        local=np.zeros((total, PARTS)),
        push=np.zeros((total, 2)),
        stack=np.zeros((4 * levels, 3), dtype=np.int64),
        top=np.zeros(1, dtype=np.int64),
        pair=np.zeros((BATCH if levels > 1 else max(n * (n - 1) // 2, 1), 2), dtype=np.int64),
        turned=np.zeros((4, PAIR_PARTS)),
    )


def new_rigid(magnets: Magnets, n: int) -> Rigid:
    """Room for the forces of pairs that are joined rigidly; nothing is known yet."""
    return _rigid(n, new_nodes(magnets, 2))


def _rigid(n: int, nodes: Nodes) -> Rigid:
    spans = max(min(n - 1, MOST_SPANS), 1)
    return Rigid(
        charge=np.zeros((n, 4)),
        stop=np.zeros(n, dtype=np.int64),
        reach=np.zeros(n, dtype=np.int64),
        code=np.zeros((n, spans), dtype=np.int64),
        force=np.zeros((n, spans, 3)),
        pose=Pose(np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)),
        charges=np.zeros((2, 4)),
        nodes=nodes,
    )


# What kernels never look at in chains without magnets, and without contact and friction.
NO_NODES = _nodes((1, 1, 1), 1)
NO_RIGID = _rigid(1, NO_NODES)
NO_NEWTON = new_newton(1, 1)


def new_record(model: Model, interval: float, capacity: int) -> Record:
    """Room for ``capacity`` frames, one every ``interval`` seconds; 0 records nothing."""
    return _record(model.n, interval, capacity) if interval > 0.0 else _no_record(model.n)


def _record(n: int, interval: float, capacity: int) -> Record:
    return Record(
        interval=interval,
        time=np.zeros(capacity),
        q=np.zeros((capacity, n + 2)),
        v=np.zeros((capacity, n + 2)),
        lo=np.zeros(capacity, dtype=np.int64),
    )


@lru_cache(maxsize=64)
def _no_record(n: int) -> Record:
    return _record(n, 0.0, 0)
