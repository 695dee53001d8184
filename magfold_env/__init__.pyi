"""The public names and the modules that define them; `__init__.py` loads a name on first use."""

from magfold_env.designer import Design as Design
from magfold_env.designer import design as design
from magfold_env.ensembles.releases import Ensemble as Ensemble
from magfold_env.ensembles.releases import ensemble as ensemble
from magfold_env.ensembles.sweeps import Sweep as Sweep
from magfold_env.ensembles.sweeps import sweep as sweep
from magfold_env.fold import Fold as Fold
from magfold_env.fold import FoldStatus as FoldStatus
from magfold_env.fold import Trajectory as Trajectory
from magfold_env.holding_loads import Holding as Holding
from magfold_env.holding_loads import holding as holding
from magfold_env.minimiser import ground_state as ground_state
from magfold_env.minimiser import minimise as minimise
from magfold_env.minimiser import sequence_of as sequence_of
from magfold_env.scene import Bumps as Bumps
from magfold_env.scene import Casing as Casing
from magfold_env.scene import Feed as Feed
from magfold_env.scene import Field as Field
from magfold_env.scene import FixedMagnet as FixedMagnet
from magfold_env.scene import Gravity as Gravity
from magfold_env.scene import Magnets as Magnets
from magfold_env.scene import Rectangle as Rectangle
from magfold_env.scene import Scene as Scene
from magfold_env.scene import SceneError as SceneError
from magfold_env.scene import Solver as Solver
from magfold_env.scene import Spreads as Spreads
from magfold_env.scene import chamber as chamber
from magfold_env.scene import channel as channel
from magfold_env.scene import funnel as funnel
from magfold_env.scene import load_scene as load_scene
from magfold_env.scene import save_scene as save_scene
from magfold_env.scene import scene_names as scene_names
from magfold_env.simulation.flux import field as field
from magfold_env.simulation.simulate import accelerations as accelerations
from magfold_env.simulation.simulate import energy as energy
from magfold_env.simulation.simulate import forces as forces
from magfold_env.simulation.simulate import simulate as simulate
from magfold_env.simulation.simulate import simulate_batch as simulate_batch

__all__: list[str]

__version__: str
