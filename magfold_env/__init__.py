"""Self-folding chains of magnets: simulation, prediction by energy, and learning.

What is public is loaded when it is first used: importing the package registers its environments
with Gymnasium and loads neither numba nor the engine.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from magfold_env.envs import register_envs

if TYPE_CHECKING:
    from magfold_env.designer import Design, design
    from magfold_env.ensembles.releases import Ensemble, ensemble
    from magfold_env.ensembles.sweeps import Sweep, sweep
    from magfold_env.fold import Fold, FoldStatus, Trajectory
    from magfold_env.limit_loads import Holding, holding
    from magfold_env.minimiser import Landscape, descend, ground_state, minimise, sequence_of
    from magfold_env.scene import (
        Bumps,
        Casing,
        Feed,
        Field,
        FixedMagnet,
        Gravity,
        Magnets,
        Rectangle,
        Scene,
        SceneError,
        Solver,
        Spreads,
        chamber,
        channel,
        funnel,
        load_scene,
        save_scene,
        scene_names,
    )
    from magfold_env.simulation.simulate import (
        accelerations,
        energy,
        forces,
        simulate,
        simulate_batch,
    )

__all__ = [
    "Bumps",
    "Casing",
    "Design",
    "Ensemble",
    "Feed",
    "Field",
    "FixedMagnet",
    "Fold",
    "FoldStatus",
    "Gravity",
    "Holding",
    "Landscape",
    "Magnets",
    "Rectangle",
    "Scene",
    "SceneError",
    "Solver",
    "Spreads",
    "Sweep",
    "Trajectory",
    "accelerations",
    "chamber",
    "channel",
    "descend",
    "design",
    "energy",
    "ensemble",
    "forces",
    "funnel",
    "ground_state",
    "holding",
    "load_scene",
    "minimise",
    "save_scene",
    "scene_names",
    "sequence_of",
    "simulate",
    "simulate_batch",
    "sweep",
]

_NAMES = {
    "designer": "Design design",
    "ensembles.releases": "Ensemble ensemble",
    "ensembles.sweeps": "Sweep sweep",
    "fold": "Fold FoldStatus Trajectory",
    "limit_loads": "Holding holding",
    "minimiser": "Landscape descend ground_state minimise sequence_of",
    "scene": "Bumps Casing Feed Field FixedMagnet Gravity Magnets Rectangle Scene SceneError "
    "Solver Spreads chamber channel funnel load_scene save_scene scene_names",
    "simulation.simulate": "accelerations energy forces simulate simulate_batch",
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Load what is public, or a package that holds some of it."""
    if name in _MODULES:
        value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
        globals()[name] = value
        return value
    if any(name == module.partition(".")[0] for module in _NAMES):
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


register_envs()
