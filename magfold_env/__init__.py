"""Self-folding chains of magnets: simulation, prediction by energy, and learning."""

from magfold_env.errors import SceneError
from magfold_env.fold import Fold, FoldStatus, Trajectory
from magfold_env.scene import Scene
from magfold_env.scene_io import load_scene, save_scene, scene_names
from magfold_env.scene_parts import Casing, Feed, Gravity, Magnets, Solver, Spreads

__all__ = [
    "Casing",
    "Feed",
    "Fold",
    "FoldStatus",
    "Gravity",
    "Magnets",
    "Scene",
    "SceneError",
    "Solver",
    "Spreads",
    "Trajectory",
    "load_scene",
    "save_scene",
    "scene_names",
]
