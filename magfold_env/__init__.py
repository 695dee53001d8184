"""Self-folding chains of magnets: simulation, prediction by energy, and learning."""

from magfold_env.designer import Design, design
from magfold_env.ensembles import Ensemble, ensemble
from magfold_env.envs import register_envs
from magfold_env.fold import Fold, FoldStatus, Trajectory
from magfold_env.minimiser import Landscape, descend, ground_state, minimise, sequence_of
from magfold_env.scene import (
    Casing,
    Feed,
    Field,
    FixedMagnet,
    Gravity,
    Magnets,
    Scene,
    SceneError,
    Solver,
    Spreads,
    load_scene,
    save_scene,
    scene_names,
)
from magfold_env.simulation.batch import simulate_batch

# After magfold_env.minimiser, the package, so that `energy` names the function: importing a
# submodule binds its name here, but only the first time.
from magfold_env.simulation.simulate import accelerations, energy, forces, simulate

__all__ = [
    "Casing",
    "Design",
    "Ensemble",
    "Feed",
    "Field",
    "FixedMagnet",
    "Fold",
    "FoldStatus",
    "Gravity",
    "Landscape",
    "Magnets",
    "Scene",
    "SceneError",
    "Solver",
    "Spreads",
    "Trajectory",
    "accelerations",
    "descend",
    "design",
    "energy",
    "ensemble",
    "forces",
    "ground_state",
    "load_scene",
    "minimise",
    "save_scene",
    "scene_names",
    "sequence_of",
    "simulate",
    "simulate_batch",
]

register_envs()
