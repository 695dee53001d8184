"""The laws that the dynamics must hold, measured over many random scenes."""
