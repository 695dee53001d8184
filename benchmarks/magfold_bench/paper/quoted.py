"""What the paper states in words and numbers, as far as something is compared with it.

Fass, Hao, Cantillon-Murphy: On planar self-folding magnetic chains: Comparison of Newton-Euler
dynamics and internal energy optimisation. Lengths in metres, angles in radians.
"""

import math

from magfold_env.minimiser import Mode

TABLE_1: dict[int, dict[Mode, str]] = {
    1: {"forward": "S1A", "backward": "S1C"},
    2: {"forward": "S2B", "backward": "S2B"},
    3: {"forward": "S3A", "backward": "S3A"},
}
"""Results of the component-by-component search, by sequence and direction."""

SCORE_S1A, SCORE_S1B = -25.8098, -25.6527
"""Coulomb energies of Figure 19; no unit is given, mJ is the right order."""

FROM_S2A, FROM_S2C = 0.5589, 0.0875
"""Section 4.1: how far the energies of S2A and S2C are from that of S2B."""

FRAME_RATE = 240.0  # [1/s] of the camera, and of all that is compared with it
COMPUTATIONS = 5  # time steps a frame, chosen after Figure 11
SNAP = 0.9 * math.pi / 2.0  # equation 40: neighbours snap together beyond
CHARGES, MANY_CHARGES = 3, 30  # a pole face, Figure 12
DISPLACEMENT = 8.2e-3  # mean over time and components, Figure 13
ANGLE = 0.442  # mean difference of relative angles, Figure 14

MAGNET_CHARGE = 17.1892  # [A m] equation 7, where each pole face gets half of it

PENDULUM_STEPS = 1000  # Figure 15
NEAR_LINEAR_UP_TO, LONGEST = 60, 450  # components, Figure 16
NEAR_LINEAR, LONG_POWER = 1.0, 1.5  # powers of n up to the one, and on to the other
