"""Design: find magnets and a feed speed with which a chain folds into a target shape."""

from magfold_env.designer.evidence import Evidence
from magfold_env.designer.exhaustive import gap_designs
from magfold_env.designer.search import candidates, design
from magfold_env.designer.task import (
    SPEEDS,
    Choice,
    Design,
    Objective,
    Search,
    Task,
    default_scene,
    task_for,
)

__all__ = [
    "SPEEDS",
    "Choice",
    "Design",
    "Evidence",
    "Objective",
    "Search",
    "Task",
    "candidates",
    "default_scene",
    "design",
    "gap_designs",
    "task_for",
]
