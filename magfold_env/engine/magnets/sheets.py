"""The interaction of two pole faces down to contact; one face is integrated in closed form.

A sum over nodes on both faces is inaccurate for faces that are closer than the nodes. However, the
interaction of upright lines (`magnets.laws`) can be integrated along the width w of face b. Let s
be a point's distance along b from one of b's ends, d its distance from b's line, ρ² = s² + d² and
R² = ρ² + u². The energy is 2/(H₁H₂ w) (G(h) − G(k)) at one end of b minus its value at the other
end, where h and k are the half sum and half difference of the heights, and

    G(u) = u s asinh(u/ρ) − u d atan(s u/(d R)) + (u² − d²)/2 asinh(s/√(d² + u²)) − s R/2

with ∂G/∂s = u asinh(u/ρ) − R and ∂G/∂d = −u atan(s u/(d R)) − d asinh(s/√(d² + u²)). Tests compare
G with quadrature. Along face a, the energy is summed over nodes. The summand behaves like d² log d
where a passes an end of b or crosses its line, so nodes are denser around these places.

Where face a is behind b, by a rounding error or a contact's permitted overlap, the force is the
limit from outside: it does not jump, and b pushes as it does in contact. Forces are the exact
gradient of the sum, including the motion of the singular places.
"""

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import direction, log1p
from magfold_env.engine.magnets.laws import FacePair
from magfold_env.engine.state import Magnets

SHORTEST = 1e-14  # [widths] nearer singular places count as one
FLATTEST2 = 1e-16  # squared slope of a face; flatter faces count as not crossing a line
LEAST2 = 1e-40  # [m²] least squared distance from a line, so that logarithms stay finite


@kernel
def between(magnets: Magnets, faces: FacePair) -> tuple[float, float, float, float]:
    """Return the energy, force and torque on face a, in the form of `pairs.level_sum`."""
    row = magnets.level_count.size - 1
    count, node, weight = magnets.level_count[row], magnets.level_node, magnets.level_weight
    wide = math.sqrt(faces.bx * faces.bx + faces.by * faces.by)
    ux, uy = faces.bx / wide, faces.by / wide
    # Face a in the frame of b, whose outward normal is (uy, −ux).
    x, y = ux * faces.x + uy * faces.y, uy * faces.x - ux * faces.y
    ax, ay = ux * faces.ax + uy * faces.ay, uy * faces.ax - ux * faces.ay
    # If faces face each other, one can be behind the other only because of an error.
    signed = ax < 0.0 and y > -0.5 * wide
    one, two, line = breaks(x, y, ax, ay, 0.5 * wide)
    first, last = min(one, two, line), max(one, two, line)
    middle = max(min(one, two), min(max(one, two), line))
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    begin, before, by_first, by_middle, by_last = -0.5, -1, 0.0, 0.0, 0.0
    for part in range(4):
        end = 0.5
        if part < 3:
            end = first if part == 0 else (middle if part == 1 else last)
        length = end - begin
        if length < SHORTEST:
            continue
        by_begin, by_end = 0.0, 0.0
        for k in range(count):
            along, w = 0.5 + node[row, k], length * weight[row, k]
            t = begin + length * along
            s, d = x + t * ax, y + t * ay
            # Only nearer to b's line than to its ends, because points beside b have not passed it.
            past = d if signed and abs(s) - 0.5 * wide < d < 0.0 else 0.0
            u, ps, pd = potential(s, abs(d - past), 0.5 * wide, faces.half_a, faces.half_b)
            u += past * pd
            px, py = -w * ps, -w * pd if d - past >= 0.0 else w * pd
            energy += w * u
            fx += px
            fy += py
            torque += t * (ax * py - ay * px)
            rise = -(ax * px + ay * py)
            by_begin += (1.0 - along) * rise - weight[row, k] * u
            by_end += along * rise + weight[row, k] * u
        # Slopes of the sum in the beginnings and ends of its parts.
        by_first += (by_begin if before == 0 else 0.0) + (by_end if part == 0 else 0.0)
        by_middle += (by_begin if before == 1 else 0.0) + (by_end if part == 1 else 0.0)
        by_last += (by_begin if before == 2 else 0.0) + (by_end if part == 2 else 0.0)
        begin, before = end, part
    # These slopes cancel for an integral, but not for the sum, nor where a is behind b's ends.
    length2 = ax * ax + ay * ay
    for place in range(3):
        t = one if place == 0 else (two if place == 1 else line)
        if abs(t) >= 0.5 - SHORTEST:
            continue
        slope = by_first if t == first else (by_middle if t == middle else by_last)
        tx, ty, turn = 0.0, -1.0 / ay if ay != 0.0 else 0.0, -t * ax / ay if ay != 0.0 else 0.0
        if place < 2:
            u, v = (-0.5 * wide if place == 0 else 0.5 * wide) - x, -y
            tx, ty, turn = -ax / length2, -ay / length2, (v * ax - u * ay) / length2
        fx -= slope * tx
        fy -= slope * ty
        torque -= slope * turn
    # The frame is a mirror image, so torques change sign.
    return energy, ux * fx + uy * fy, uy * fx - ux * fy, -torque


@inlined
def breaks(x: float, y: float, ax: float, ay: float, half: float) -> tuple[float, float, float]:
    """Return where face a passes b's ends and b's line, or a's end, in widths from a's centre."""
    length2 = ax * ax + ay * ay
    one = ((-half - x) * ax - y * ay) / length2
    two = ((half - x) * ax - y * ay) / length2
    crosses = abs(ay) > abs(y) and ay * ay > FLATTEST2 * length2
    return clipped(one), clipped(two), clipped(-y / ay) if crosses else 0.5


@inlined
def clipped(t: float) -> float:
    """Return a place on face a in widths from its centre, clipped to the face's ends."""
    return min(max(t, -0.5), 0.5)


@inlined
def potential(
    s: float, d: float, half: float, half_a: float, half_b: float
) -> tuple[float, float, float]:
    """Return the energy of an upright line and a face of unit charges, and its slopes.

    The results lack the factor µ0/4π [1/m, 1/m²]. The face has the half width ``half``; the line is
    ``d`` in front of it and ``s`` beside its centre. The slopes are in ``s`` and ``d``.
    """
    total, difference = half_a + half_b, abs(half_a - half_b)
    u, ps, pd = primitive(s - half, s + half, d, total)
    v, qs, qd = primitive(s - half, s + half, d, difference)
    share = 1.0 / (4.0 * half * half_a * half_b)
    return share * (u - v), share * (ps - qs), share * (pd - qd)


@inlined
def primitive(low: float, high: float, d: float, u: float) -> tuple[float, float, float]:
    """Return the difference of G(u) between two ends, and its slopes in s and in d ≥ 0."""
    d2, u2 = max(d * d, LEAST2), u * u
    c2 = d2 + u2
    near, far = math.sqrt(low * low + d2), math.sqrt(high * high + d2)
    begin, end = math.sqrt(low * low + c2), math.sqrt(high * high + c2)
    # Differences of asinh(s/c) are written as one logarithm without cancellation.
    if low >= 0.0:
        log = log1p((high - low + end - begin) / (low + begin))
    elif high <= 0.0:
        log = log1p((high - low + begin - end) / (end - high))
    else:
        log = log1p(((high + end) * (begin - low) - c2) / c2)
    value, along = 0.5 * (u2 - d2) * log - 0.5 * (high * end - low * begin), begin - end
    away = -d * log
    if u > 0.0:
        before = log1p((u + u2 / (begin + near)) / near)
        behind = log1p((u + u2 / (end + far)) / far)
        # The difference of two arc tangents is written as one.
        begin, end = d * begin, d * end
        angle = direction(begin * end + u2 * (low * high), u * (high * begin - low * end))
        value += u * (high * behind - low * before - d * angle)
        along += u * (behind - before)
        away -= u * angle
    return value, along, away
