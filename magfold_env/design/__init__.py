"""Design: sequences of magnets that shall fold into a wanted shape."""

from magfold_env.design.gap import GapDesign, gap_designs

__all__ = ["GapDesign", "gap_designs"]
