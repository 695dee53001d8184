"""Statements and numbers from the paper with which this project's results are compared.

Fass, Hao, Cantillon-Murphy: On planar self-folding magnetic chains: Comparison of Newton-Euler
dynamics and internal energy optimisation. Lengths are in metres, angles in radians.
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
"""Coulomb energies in Figure 19; the paper gives no unit, but mJ is the right order."""

FROM_S2A, FROM_S2C = 0.5589, 0.0875
"""Section 4.1: relative differences between S2B's energy and those of S2A and S2C."""

FRAME_RATE = 240.0  # [1/s] of the camera and everything compared with it
COMPUTATIONS = 5  # time steps per frame, chosen after Figure 11
SNAP = 0.9 * math.pi / 2.0  # equation 40: beyond this angle, neighbours snap together
CHARGES, MANY_CHARGES = 3, 30  # per pole face, Figure 12
DISPLACEMENT = 8.2e-3  # mean over time and components, Figure 13
ANGLE = 0.442  # mean difference in relative angles, Figure 14

MAGNET_CHARGE = 17.1892  # [A m]; equation 7 gives each pole face half of it

PENDULUM_STEPS = 1000  # Figure 15
NEAR_LINEAR_UP_TO, LONGEST = 60, 450  # components, Figure 16
NEAR_LINEAR, LONG_POWER = 1.0, 1.5  # powers of n up to the first length, then up to the second
