"""How a step, and an integration, can end."""

# One step.
ACCEPTED, TOUCHED, RATTLED, TOO_SHORT, BROKEN, UNSOLVABLE = range(6)

# An integration.
REACHED, RESTED, CAPPED, UNDERFLOW, NOT_FINITE, TOO_CROWDED, NO_SOLUTION, FULL, JAMMED = range(9)

# A chain that had its time to settle and still moves.
TIMED_OUT = 9
