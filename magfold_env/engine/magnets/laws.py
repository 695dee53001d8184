"""The interaction of two nodes of pole faces, and the step that blends two rules.

Nodes represent upright lines of heights H₁ and H₂, centred on the plane. With half sum a and half
difference b of the heights, and A = √(ρ² + a²), B = √(ρ² + b²) at an in-plane offset d (|d| = ρ),
the integrals are: force 2 d / (ρ² (A + B)), energy 2/(a² − b²) (a asinh(a/ρ) − b asinh(b/ρ) − A +
B), both times (µ0/4π) q_k q_l; for equal heights b = 0 and B = ρ. Point charges follow Coulomb's
law.

All functions are plain arithmetic, so that loops over nodes vectorise.
"""

import math
from typing import NamedTuple

from magfold_env.engine.compile.jit import inlined
from magfold_env.engine.elementary import log1p

COULOMB = 1e-7  # µ0 / 4π [N/A²]
SPREAD = 1.25  # blending of two rules for casings or segments ends at this many radii
NEAREST2 = 1e-16  # [m²] smaller distances than 10 nm count as 10 nm, so that forces stay finite


class FacePair(NamedTuple):
    """Two pole faces a and b, centred on the plane."""

    even: bool  # equal heights
    half_a: float  # half the heights [m]
    half_b: float
    x: float  # from b's centre to a's [m]
    y: float
    ax: float  # vectors along the widths, of the same length [m]
    ay: float
    bx: float
    by: float


@inlined
def node_force(strips: bool, sum2: float, difference2: float, r2: float) -> float:
    """Return the force between unit charges, divided by their distance, without µ0/4π [1/m³].

    ``sum2`` is a², ``difference2`` is b² [m²] (both unused for points), and ``r2`` is ρ² > 0.
    """
    if strips:
        return 2.0 / (r2 * (math.sqrt(r2 + difference2) + math.sqrt(r2 + sum2)))
    return 1.0 / (r2 * math.sqrt(r2))


@inlined
def node_law(
    strips: bool, even: bool, sum2: float, difference2: float, r2: float
) -> tuple[float, float]:
    """Return the result of `node_force`, and the energy of unit charges without µ0/4π [1/m].

    Lines are ``even`` if all have the same height; ``difference2`` is then not used.
    """
    r = math.sqrt(r2)
    if not strips:
        return 1.0 / (r2 * r), 1.0 / r
    a = math.sqrt(sum2)
    if even:
        total = r + math.sqrt(r2 + sum2)
        # This needs one division instead of two; divisions take most of the time.
        both = 1.0 / (r * total)
        inverse, inverse_r = both * r, both * total
        # A − ρ, and asinh(a/ρ) by log(1 + z), without loss of digits at large distances.
        rise = sum2 * inverse
        energy = 2.0 / sum2 * (a * log1p((a + rise) * inverse_r) - rise)
        return 2.0 * inverse * inverse_r * inverse_r, energy
    b = math.sqrt(difference2)
    far, near = math.sqrt(r2 + sum2), math.sqrt(r2 + difference2)
    inverse_r = 1.0 / r
    inverse = 1.0 / (far + near)
    outer = a * log1p((a + sum2 / (far + r)) * inverse_r)
    inner = b * log1p((b + difference2 / (near + r)) * inverse_r)
    product = sum2 - difference2
    energy = 2.0 / product * (outer - inner - product * inverse)
    return 2.0 * inverse * inverse_r * inverse_r, energy


@inlined
def step_down(ratio: float, end: float) -> tuple[float, float]:
    """Return a twice differentiable weight, 1 to a ratio of 1 and 0 from ``end``, and its slope."""
    if ratio <= 1.0:
        return 1.0, 0.0
    if ratio >= end:
        return 0.0, 0.0
    t = (ratio - 1.0) / (end - 1.0)
    return (
        1.0 - t * t * t * (10.0 - 15.0 * t + 6.0 * t * t),
        -30.0 * t * t * (1.0 - t) * (1.0 - t) / (end - 1.0),
    )


@inlined
def between_rules(
    near: tuple[float, float, float, float], far: tuple[float, float, float, float],
    ratio: float, spread: float, radius: float, ex: float, ey: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Blend energy, force and torque of two rules for a pair; forces stay the energy's gradient.

    ``ratio`` is the distance that decides between the rules, divided by ``radius`` [m]. The
    distance grows along (ex, ey) [m], which points to the body on which the force acts.
    """
    u, fx, fy, t = near
    low, lx, ly, lt = far
    weight, slope = step_down(ratio, spread)
    # −∂w/∂x (U_near − U_far) acts along the line between the centres.
    push = -slope / radius * (u - low) / math.sqrt(max(ex * ex + ey * ey, NEAREST2))
    return (
        low + weight * (u - low),
        lx + weight * (fx - lx) + push * ex,
        ly + weight * (fy - ly) + push * ey,
        lt + weight * (t - lt),
    )
