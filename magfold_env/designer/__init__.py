"""Design: magnets, and a feed speed, with which a chain folds into a wanted shape."""

from magfold_env.designer.designer import design
from magfold_env.designer.evidence import Evidence
from magfold_env.designer.gap import GapDesign, gap_designs
from magfold_env.designer.result import Design

__all__ = ["Design", "Evidence", "GapDesign", "design", "gap_designs"]
