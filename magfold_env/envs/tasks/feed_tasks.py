"""Tasks with a given chain or given components, and the folds to reach."""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import chain_name
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.spaces.actions import PATTERNS, ActionKind
from magfold_env.envs.spaces.observation import CameraLayout
from magfold_env.envs.tasks.checks import refuse_unknown, share_of
from magfold_env.envs.tasks.draws import Randomisation
from magfold_env.envs.tasks.goals import Match
from magfold_env.envs.tasks.reward import RewardKind, Shaping
from magfold_env.envs.tasks.targets import is_target
from magfold_env.envs.tasks.world import World
from magfold_env.files import configs_dir
from magfold_env.scene import Problem, Scene, SceneError, load_scene
from magfold_env.scene.io import parse_yaml
from magfold_env.scene.parts import Part
from magfold_env.scene.scene import Component

if TYPE_CHECKING:
    from magfold_env.envs.camera_track import CameraEpisodes


class Task(Part):
    """The direction of feed and the fold to reach."""

    direction: Literal["forward", "backward"]
    """Direction of feed."""
    target: str
    """Word to reach."""

    @property
    def n(self) -> int:
        """Number of components of the chain."""
        return len(self.target) + 1

    def as_fed(self, chain: Any) -> Any:
        """Convert an array from component order to the order of feed, or back."""
        return chain if self.direction == "forward" else chain[::-1]

    @property
    @abstractmethod
    def parts(self) -> tuple[str, ...]:
        """The available components."""

    @property
    def words(self) -> tuple[str, ...]:
        """The words to reach, one after the other."""
        return (self.target,)

    @property
    def aim(self) -> str:
        """The goal as one string."""
        return "-".join(self.words)

    @property
    def name(self) -> str:
        """Cache key of the baseline."""
        return chain_name(self.parts, self.direction, self.aim)


class FeedTask(Task):
    """A task with a given chain."""

    sequence: tuple[Component, ...]
    """The components, component 1 first."""

    @property
    def n(self) -> int:
        """Number of components of the chain."""
        return len(self.sequence)

    @property
    def parts(self) -> tuple[str, ...]:
        """The available components."""
        return self.sequence


class RefoldTask(FeedTask):
    """A task with a given chain and two folds to reach."""

    first: str
    """Word to reach before the target."""

    @property
    def words(self) -> tuple[str, ...]:
        """The words to reach, one after the other."""
        return (self.first, self.target)


def task_list_names() -> list[str]:
    """Return the names of the shipped lists of tasks, sorted."""
    return sorted(path.stem for path in (configs_dir() / "tasks").glob("*.yaml"))


def read_tasks(
    tasks: str | Path | Sequence[Task | Mapping[str, Any]], kind: type[Task] = FeedTask
) -> tuple[Any, ...]:
    """Return the given tasks, or those of a shipped list (the easiest first) or of a YAML file.

    Raises
    ------
    ValueError
        If there is no such list or file, it is empty, or its chains have different lengths.
    SceneError
        If a file is not a list of tasks, or a task is not valid; one line per problem.
    """
    if not isinstance(tasks, (str, Path)):
        return _checked(tasks, kind)
    path = Path(tasks)
    if str(tasks) in task_list_names():
        path = configs_dir() / "tasks" / f"{tasks}.yaml"
    elif not path.is_file():
        raise _no_tasks(tasks)
    try:
        return _checked(cast("Any", parse_yaml(path.read_text(encoding="utf-8"))), kind)
    except (OSError, ValueError) as error:
        problems = error.problems if isinstance(error, SceneError) else ()
        raise SceneError(problems or str(error), source=str(path)) from None


def _checked(tasks: Sequence[Task | Mapping[str, Any]], kind: type[Task]) -> tuple[Any, ...]:
    """Return tasks as models; refuse invalid tasks and chains of different lengths."""
    if not (isinstance(tasks, (list, tuple)) and all(map(_is_task, tasks))):
        raise _no_tasks(tasks)
    found = tuple(each if isinstance(each, kind) else kind(**dict(each)) for each in tasks)
    lengths = sorted({task.n for task in found})
    if len(lengths) != 1:
        raise ValueError(
            f"tasks: chains of {lengths} components are not allowed; must be one or more tasks "
            "of one length"
        )
    allowed = f"must be a fully folded word of {lengths[0]} components without overlap"
    for task in found:
        for key, word in zip(("target", "first"), task.words[::-1], strict=False):
            if not is_target(word, lengths[0]):
                raise SceneError([Problem(f"tasks.{key}", word, allowed)])
    return found


def _no_tasks(given: object) -> ValueError:
    return ValueError(
        f"tasks: {given!r} is not allowed; must be a list of tasks, the path of a file of them or "
        f"one of {', '.join(task_list_names())}"
    )


def _is_task(value: object) -> bool:
    return isinstance(value, (Task, Mapping))


class FeedOptions(TypedDict, total=False):
    """Options of environments with given tasks; all are optional."""

    tasks: str | Path | Sequence[Task | Mapping[str, Any]]
    """Name of a shipped list of tasks, path of a YAML file, or the tasks themselves; by default the
    environment's own list."""
    match: Match
    """``word``: the fold must be the target. ``outline``: it must cover the same cells."""
    difficulty: float
    """Share of the tasks to draw from, the easiest first; 1 by default."""
    fidelity: Literal["dynamics"]
    """Only ``dynamics``: energy minimisation, ``quasistatic``, has no speeds."""
    randomisation: Randomisation
    """Physics drawn at reset. ``scene`` (default): the scene's own spreads. ``none``: no draws, a
    straight chain and sound magnets. ``nominal``: friction ±10 %, remanence ±5 %, speed of each
    component ±5 %, release angles ±0.03 rad. ``strong``: ±30 %, ±10 %, ±20 %, and ±0.1 rad or the
    tube's clearance."""
    speeds: int
    """Number of speed levels, 5 by default. Where the agent sets only the speed: each way, besides
    standstill."""
    actions: ActionKind
    """How actions are written. ``box`` (default): a number from −1 to 1. ``discrete``: the number
    of a speed level. ``multidiscrete``: that in a list. With a tray ``multidiscrete`` (default):
    component, orientation, speed level and kind of step; or ``discrete``: these as one number."""
    reward: RewardKind
    """``score`` (default), ``relative`` or ``sparse``; see `magfold_env.envs.tasks.reward`."""
    shaping: bool | Shaping
    """Potential-based shaping: False (default), ``similarity`` (or True) or ``energy``."""
    gamma: float
    """Discount of the shaping, 1 by default; must be the agent's own."""


class TaskWorld(World):
    """Tasks and their world.

    Parameters
    ----------
    episodes : type
        The class of the episodes: it defines the type of a task, the actions and the observations.
    scene : str, Path or Scene
        A tube scene; sequence, direction and speeds come from the tasks and the agent.
    **options
        See `FeedOptions`; ``tasks`` must be given.

    Raises
    ------
    ValueError
        If an option is not allowed; the message names it and the allowed values.
    """

    option = ("task", int)
    layout: CameraLayout

    def __init__(
        self,
        episodes: "type[CameraEpisodes]",
        scene: str | Path | Scene,
        **options: Unpack[FeedOptions],
    ) -> None:
        refuse_unknown(options, FeedOptions)
        if options.get("fidelity", "dynamics") != "dynamics":
            raise ValueError(
                f"fidelity: {options.get('fidelity')!r} is not allowed; must be 'dynamics', "
                "energy minimisation knows of no speed"
            )
        scene = scene if isinstance(scene, Scene) else load_scene(scene)
        if scene.mount != "tube":
            raise ValueError(f"scene.mount: {scene.mount!r} is not allowed; must be 'tube'")
        found = read_tasks(options.get("tasks", ()), episodes.task_kind)
        share = share_of("difficulty", options.get("difficulty", 1.0))
        self.tasks = found[: math.ceil(share * len(found) - 1e-9)]
        self.words = tuple(task.target for task in self.tasks)
        scene = scene.replace(sequence=found[0].parts[: found[0].n], start_angles=None)
        super().__init__(scene, options, randomisation="scene")
        directions = dict.fromkeys(task.direction for task in self.tasks)
        self.templates: tuple[Scene, ...] = tuple(
            self.scene.replace(feed={"direction": direction}) for direction in directions
        )
        """The templates of episodes: a scene for each direction of feed."""
        self.kinds: tuple[int, ...] = tuple(
            list(directions).index(task.direction) for task in self.tasks
        )
        """Index of the template of each task."""
        # No functools.cache: environments are pickled.
        self._lattices: dict[int, LatticeFeed] = {}
        self.actions, self.layout = episodes.spaces(self, options)

    @cached_property
    def patterns(self) -> NDArray[np.int64]:
        """Pattern numbers of the available components, (tasks, parts)."""
        return np.array([[PATTERNS.index(faces) for faces in task.parts] for task in self.tasks])

    def number_of(self, value: int) -> int:
        """Return the number of a task; see `World.number_of`."""
        if value not in range(len(self.tasks)):
            raise ValueError(
                f"options['task']: {value!r} is not allowed; must be 0..{len(self.tasks) - 1}"
            )
        return int(value)

    def lattice_of(self, number: int) -> LatticeFeed:
        """Return the rules by which energy minimisation folds the chain of a task."""
        kind = self.kinds[number]
        if kind not in self._lattices:
            self._lattices[kind] = LatticeFeed(self.templates[kind])
        return self._lattices[kind]
