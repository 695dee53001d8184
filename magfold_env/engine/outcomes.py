"""How a single step can end."""

ACCEPTED, TOUCHED, RATTLED, TOO_SHORT, BROKEN = range(5)
