"""The field group of a scene: what acts on the chain's magnets from outside."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from magfold_env.scene.base import MU0, Number, Part, Positive

Array = npt.NDArray[np.float64]


class FixedMagnet(Part):
    """A block magnet that does not move, centred on the plane.

    It acts on the chain's magnets, and casings collide with it where scenes have contact.
    """

    position: tuple[Number, Number]
    """Its centre [m]; the origin is the tube's mouth, else component 1's outer hinge at first."""
    heading: Number = 0.0
    """Direction of its magnetisation, from its south to its north pole [rad]; 0 is along +x."""
    width: Positive
    """Pole face in the plane [m]."""
    height: Positive
    """Pole face normal to the plane [m]."""
    thickness: Positive
    """Distance between its two pole faces, along its heading [m]."""
    remanence: Positive = 1.2
    """Residual flux density [T]."""

    @property
    def charge(self) -> float:
        """Magnetic charge of its north face [A m]; that of its south face is its negative."""
        return self.remanence * self.width * self.height / MU0

    @property
    def poles(self) -> Array:
        """Centres of its north and its south face [m], shape (2, 2)."""
        along = 0.5 * self.thickness * np.array([np.cos(self.heading), np.sin(self.heading)])
        return np.array(self.position) + np.array([along, -along])

    @property
    def corners(self) -> Array:
        """Its outline in the plane [m], shape (4, 2): the north face first, counter-clockwise."""
        across = 0.5 * self.width * np.array([-np.sin(self.heading), np.cos(self.heading)])
        north, south = self.poles
        return np.array([north - across, north + across, south + across, south - across])

    def overlaps_tube(self, half_width: float) -> bool:
        """Whether it reaches into the tube: x < 0 and |y| < `half_width` [m], walls included."""
        corners = self.corners
        # The tube, cut off beyond the magnet: two convex outlines overlap unless an edge of one
        # of them separates them.
        end = min(float(corners[:, 0].min()), 0.0) - half_width
        tube = np.array(
            [(end, -half_width), (0.0, -half_width), (0.0, half_width), (end, half_width)]
        )
        for outline in (corners, tube):
            for start, stop in pairwise(outline[:3]):
                along = stop - start
                one, other = corners @ along, tube @ along
                if one.max() <= other.min() or other.max() <= one.min():
                    return False
        return True


class Field(Part):
    """An external magnetic field: even everywhere, that of a fixed magnet, or both."""

    uniform: tuple[Number, Number] = (0.0, 0.0)
    """Flux density along x and y [T]; it turns the chain's magnets and does not pull them."""
    magnet: FixedMagnet | None = None
    """A fixed magnet outside the tube."""

    @property
    def any(self) -> bool:
        """Whether there is something that acts."""
        return self.magnet is not None or any(self.uniform)
