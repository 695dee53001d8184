"""Friction with the floor: its law, sliding, sticking and rest."""
