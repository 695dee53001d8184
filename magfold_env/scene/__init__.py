"""What a user states: a scene, its groups, and how they are read and written."""

from magfold_env.scene.errors import Problem, SceneError
from magfold_env.scene.io import load_scene, save_scene, scene_names
from magfold_env.scene.magnets import FACES, Magnets
from magfold_env.scene.parts import (
    Casing,
    Feed,
    Field,
    FixedMagnet,
    Gravity,
    Schedule,
    Solver,
    Spreads,
)
from magfold_env.scene.scene import SIGNS, Scene

__all__ = [
    "FACES",
    "SIGNS",
    "Casing",
    "Feed",
    "Field",
    "FixedMagnet",
    "Gravity",
    "Magnets",
    "Problem",
    "Scene",
    "SceneError",
    "Schedule",
    "Solver",
    "Spreads",
    "load_scene",
    "save_scene",
    "scene_names",
]
