"""What two nodes of pole faces do to each other, and the step that blends two sums over nodes.

Nodes stand for lines of heights H₁ and H₂, centred on the plane. With their half sum a, their half
difference b, and A = √(ρ² + a²), B = √(ρ² + b²) at the in-plane distance ρ, the integral out of the
plane is closed: force 2 d / (ρ² (A + B)), energy 2/(a² − b²) (a asinh(a/ρ) − b asinh(b/ρ) − A + B),
both times (µ0/4π) q_k q_l; for equal heights b = 0 and B = ρ. Point charges follow Coulomb's law.

Everything here is plain arithmetic, so that loops over nodes vectorise.
"""

import math
from typing import NamedTuple

from magfold_env.engine.compile.jit import inlined
from magfold_env.engine.elementary import log1p

COULOMB = 1e-7  # µ0 / 4π [N/A²]
SPREAD = 1.25  # two rules for casings or segments are blended up to this many radii
NEAREST2 = 1e-16  # [m²] poles do not come nearer than 10 nm, lest forces end as no numbers


class FacePair(NamedTuple):
    """Two pole faces a and b, which stand half their heights above the plane and below it."""

    even: bool  # of one height
    half_a: float  # half their heights [m]
    half_b: float
    x: float  # a's centre from b's [m]
    y: float
    ax: float  # vectors along their widths and as long [m]
    ay: float
    bx: float
    by: float


@inlined
def node_force(strips: bool, sum2: float, difference2: float, r2: float) -> float:
    """Force between unit charges divided by their distance vector, without µ0/4π [1/m³].

    ``sum2`` is a² and ``difference2`` is b² [m²]; points have neither. ``r2``, ρ², is above 0.
    """
    if strips:
        return 2.0 / (r2 * (math.sqrt(r2 + difference2) + math.sqrt(r2 + sum2)))
    return 1.0 / (r2 * math.sqrt(r2))


@inlined
def node_law(
    strips: bool, even: bool, sum2: float, difference2: float, r2: float
) -> tuple[float, float]:
    """Force as `node_force` gives it, and energy of unit charges without µ0/4π [1/m].

    Lines are ``even`` if all have one height: ``difference2`` is then left out.
    """
    r = math.sqrt(r2)
    if not strips:
        return 1.0 / (r2 * r), 1.0 / r
    a = math.sqrt(sum2)
    if even:
        total = r + math.sqrt(r2 + sum2)
        # One division for two: they cost the most here.
        both = 1.0 / (r * total)
        inverse, inverse_r = both * r, both * total
        # A − ρ, and asinh(a/ρ) by log(1 + z): neither loses digits far away.
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
    """Weight and its derivative: 1 for ratio ≤ 1, 0 for ratio ≥ ``end``, C² between."""
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
    """Blend what two rules say of a pair: energy, force and torque, all with the energy's gradient.

    ``ratio`` is the distance that decides over ``radius`` [m]; (ex, ey) [m] points to the body that
    feels them, along whose line that distance grows.
    """
    u, fx, fy, t = near
    low, lx, ly, lt = far
    weight, slope = step_down(ratio, spread)
    # −∂w/∂x (U_near − U_far) acts along the line of the centres.
    push = -slope / radius * (u - low) / math.sqrt(max(ex * ex + ey * ey, NEAREST2))
    return (
        low + weight * (u - low),
        lx + weight * (fx - lx) + push * ex,
        ly + weight * (fy - ly) + push * ey,
        lt + weight * (t - lt),
    )
