"""Decide which casings interact one by one, and which as segments expanded in multipoles.

Level l of a tree holds segments of 2^l consecutive components. Two segments whose centres (the
means of their components' centres) are farther apart than 2^l times a radius interact by their
`multipoles`; nearer ones act through their children, which are half as long. From the radius to
`SPREAD` times the radius, both energies are blended, so that the energy is twice differentiable and
forces are its exact gradient, as with ranks and levels in `pairs`. Because its components are
joined, a segment is longest when stretched, so the radius bounds the error in any shape.

`begin` finds the segments' moments; `list_pairs` lists pairs of single casings until none are left,
and sums the interactions of segments on the way; `finish` passes those sums down to the components.
Chains of fewer than `LONG` components have no segments other than single casings.
"""

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets import multipoles
from magfold_env.engine.magnets.laws import SPREAD, step_down
from magfold_env.engine.state import Array, Loads, Segments

LONG = 16  # number of components from which segments save time
BATCH = 4096  # pairs listed at a time


@kernel
def begin(first: int, x: Array, y: Array, segments: Segments) -> None:
    """Compute the segments' centres and moments from those of components from ``first`` on."""
    levels, n = segments.start.size, x.size
    segments.top[0] = 1
    segments.stack[0, 0] = levels - 1
    segments.stack[0, 1] = first if levels == 1 else 0
    segments.stack[0, 2] = 0
    if levels == 1:
        return
    for row in range(segments.x.size):
        segments.push[row, 0], segments.push[row, 1] = 0.0, 0.0
        multipoles.clear(segments.local, row, multipoles.OCTUPOLES)
    for i in range(first, n):
        segments.x[i], segments.y[i] = x[i], y[i]
    for level in range(1, levels):
        for s in range(first >> level, ((n - 1) >> level) + 1):
            row, below = segments.start[level] + s, segments.start[level - 1]
            low, high = children_of(level, s, first, n)
            segments.charged[row], segments.x[row], segments.y[row] = 0, 0.0, 0.0
            multipoles.clear(segments.moment, row, multipoles.OCTUPOLES)
            for child in range(low, high):
                share, part = share_of(level, s, child, first, n), below + child
                segments.x[row] += share * segments.x[part]
                segments.y[row] += share * segments.y[part]
                segments.charged[row] |= segments.charged[part]
            for part in range(below + low, below + high):
                multipoles.add_moments(segments, part, row)


@inlined
def children_of(level: int, s: int, first: int, n: int) -> tuple[int, int]:
    """Return the range of segment s's children on the level below."""
    return max(2 * s, first >> (level - 1)), min(2 * s + 1, (n - 1) >> (level - 1)) + 1


@inlined
def share_of(level: int, s: int, child: int, first: int, n: int) -> float:
    """Return a child's share of the components in segment s, counted from ``first`` on."""
    members = min((child + 1) << (level - 1), n) - max(child << (level - 1), first)
    return members / (min((s + 1) << level, n) - max(s << level, first))


@kernel
def list_pairs(
    first: int, lo: int, n: int, radius: float, with_energy: bool, segments: Segments
) -> tuple[int, float]:
    """List the next pairs of casings in ``segments.pair``; return their number, or 0 at the end.

    Also returns the energy [J] of segment pairs met on the way, complete only if ``with_energy`` is
    true. Omits components without charge, and pairs of held components (before ``lo``).
    """
    if segments.start.size == 1:
        return list_all(lo, n, segments), 0.0
    start, stack, pair, charged = segments.start, segments.stack, segments.pair, segments.charged
    energy, count, top = 0.0, 0, segments.top[0]
    while top > 0 and count < pair.shape[0]:
        top -= 1
        level, s, t = stack[top, 0], stack[top, 1], stack[top, 2]
        a, b = start[level] + s, start[level] + t
        if charged[a] == 0 or charged[b] == 0 or (t + 1) << level <= lo:
            continue
        if level == 0:
            if s != t:
                pair[count, 0], pair[count, 1] = s, t
                count += 1
            continue
        near = radius * (1 << level)
        if s != t:
            dx, dy = segments.x[a] - segments.x[b], segments.y[a] - segments.y[b]
            distance = math.sqrt(dx * dx + dy * dy)
            if distance >= SPREAD * near:
                energy += multipoles.expand_segments(segments, a, b, 1.0)
                continue
            if distance > near:
                energy += blend(level, s, t, first, n, near, segments)
                continue
        low, high = children_of(level, s, first, n)
        other, end = children_of(level, t, first, n)
        for u in range(low, high):
            for v in range(max(other, u), end):
                stack[top, 0], stack[top, 1], stack[top, 2] = level - 1, u, v
                top += 1
    segments.top[0] = top
    return count, energy


@inlined
def list_all(lo: int, n: int, segments: Segments) -> int:
    """List all pairs of a short chain on the first call, and none later."""
    if segments.top[0] == 0:
        return 0
    segments.top[0] = 0
    count = 0
    for i in range(segments.stack[0, 1], n):
        if segments.charged[i] == 0:
            continue
        for j in range(max(i + 1, lo), n):
            if segments.charged[j] != 0:
                segments.pair[count, 0], segments.pair[count, 1] = i, j
                count += 1
    return count


@kernel
def blend(level: int, s: int, t: int, first: int, n: int, near: float, segments: Segments) -> float:
    """Blend two segments' interaction with that of their children; return the energy [J].

    The children must be far enough apart to be expanded.
    """
    a, b, below = segments.start[level] + s, segments.start[level] + t, segments.start[level - 1]
    dx, dy = segments.x[a] - segments.x[b], segments.y[a] - segments.y[b]
    distance = math.sqrt(dx * dx + dy * dy)
    weight, slope = step_down(distance / near, SPREAD)
    whole, parts = multipoles.expand_segments(segments, a, b, 1.0 - weight), 0.0
    low, high = children_of(level, s, first, n)
    other, end = children_of(level, t, first, n)
    for u in range(below + low, below + high):
        for v in range(below + other, below + end):
            parts += multipoles.expand_segments(segments, u, v, weight)
    push = -slope / near * (parts - whole) / distance
    segments.push[a, 0] += push * dx
    segments.push[a, 1] += push * dy
    segments.push[b, 0] -= push * dx
    segments.push[b, 1] -= push * dy
    return whole + weight * (parts - whole)


@kernel
def finish(first: int, n: int, segments: Segments, loads: Loads) -> None:
    """Add the segments' loads to the forces [N] and torques [N·m] from component ``first`` on."""
    start, levels, push = segments.start, segments.start.size, segments.push
    if levels == 1:
        return
    for level in range(levels - 1, 0, -1):
        for s in range(first >> level, ((n - 1) >> level) + 1):
            low, high = children_of(level, s, first, n)
            for child in range(low, high):
                row, part = start[level] + s, start[level - 1] + child
                share = share_of(level, s, child, first, n)
                # The force from the child's own derivatives is found before it inherits others: the
                # rest, which derivatives do not transmit, acts on all members alike.
                px, py = multipoles.force_of(segments, part)
                push[part, 0] += share * push[row, 0] - px
                push[part, 1] += share * push[row, 1] - py
                multipoles.add_derivatives(segments, row, part)
    for i in range(first, n):
        px, py = multipoles.force_of(segments, i)
        loads.fx[i] += px + push[i, 0]
        loads.fy[i] += py + push[i, 1]
        loads.torque[i] += multipoles.torque_of(segments, i)
