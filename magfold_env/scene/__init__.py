"""Scenes: the user's input, its groups of keys, and functions that read and write scenes."""

from magfold_env.scene.errors import Problem, SceneError
from magfold_env.scene.io import load_scene, save_scene, scene_names
from magfold_env.scene.magnets import FACES, Magnets
from magfold_env.scene.obstacles import Rectangle, chamber, channel, funnel
from magfold_env.scene.scene import SIGNS, Scene, unless_a_scene
from magfold_env.scene.sections import (
    Bumps,
    Casing,
    Feed,
    Field,
    FixedMagnet,
    Gravity,
    Schedule,
    Solver,
    Spreads,
)

__all__ = [
    "FACES",
    "SIGNS",
    "Bumps",
    "Casing",
    "Feed",
    "Field",
    "FixedMagnet",
    "Gravity",
    "Magnets",
    "Problem",
    "Rectangle",
    "Scene",
    "SceneError",
    "Schedule",
    "Solver",
    "Spreads",
    "chamber",
    "channel",
    "funnel",
    "load_scene",
    "save_scene",
    "scene_names",
    "unless_a_scene",
]
