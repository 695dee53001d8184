"""Colours of all pictures."""

Colour = tuple[int, int, int] | tuple[int, int, int, int]

FLOOR: Colour = (250, 249, 246)
INK: Colour = (38, 42, 48)
FAINT: Colour = (120, 126, 134)
CASING: Colour = (222, 227, 232)
CASING_EDGE: Colour = (74, 82, 92)
NORTH: Colour = (206, 56, 48)
SOUTH: Colour = (42, 98, 176)
EMPTY: Colour = (240, 242, 244)
LETTER: Colour = (255, 255, 255)
TUBE: Colour = (134, 142, 150)
BORE: Colour = (236, 234, 228)
GHOST: Colour = (88, 160, 120, 70)
GHOST_EDGE: Colour = (60, 128, 90, 150)
CONFLICT: Colour = (245, 158, 11)
WARNING: Colour = (173, 84, 8)
GOOD: Colour = (34, 120, 70)
FIELD: Colour = (110, 72, 150)
PANEL: Colour = (240, 240, 236)
MARKED: Colour = (126, 58, 168)
HELD: Colour = (90, 90, 90)
SHADE: Colour = (250, 249, 246, 246)


def shares(colour: Colour) -> tuple[float, ...]:
    """Return a colour in matplotlib's form, with channels from 0 to 1."""
    return tuple(channel / 255.0 for channel in colour)
