"""Tasks with a given chain or given components, and the folds to reach."""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import chain_name
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.spaces.actions import PATTERNS, ActionKind
from magfold_env.envs.spaces.observation import CameraLayout
from magfold_env.envs.tasks.checks import refuse_unknown, require, share_of
from magfold_env.envs.tasks.draws import Randomisation
from magfold_env.envs.tasks.goals import Match
from magfold_env.envs.tasks.targets import is_target
from magfold_env.envs.tasks.world import RewardOptions, World
from magfold_env.files import configs_dir
from magfold_env.scene import Problem, Scene, SceneError, load_scene
from magfold_env.scene.base import FrozenModel
from magfold_env.scene.io import parse_yaml
from magfold_env.scene.scene import Component

if TYPE_CHECKING:
    from magfold_env.envs.camera_track import CameraEpisodes


class Task(FrozenModel):
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
    path = Path(tasks) if isinstance(tasks, (str, Path)) else None
    if path is not None and str(tasks) in task_list_names():
        path = configs_dir() / "tasks" / f"{tasks}.yaml"
    if path is None or not path.is_file():
        return _checked(tasks, kind)
    try:
        return _checked(cast("Any", parse_yaml(path.read_text(encoding="utf-8"))), kind)
    except (OSError, ValueError) as error:
        problems = error.problems if isinstance(error, SceneError) else ()
        raise SceneError(problems or str(error), source=str(path)) from None


def _checked(tasks: object, kind: type[Task]) -> tuple[Any, ...]:
    """Return tasks as models; refuse what are none, and chains of different lengths."""
    listed = isinstance(tasks, (list, tuple))
    given = cast("list[Any]", tasks if listed else [None])
    right = all(isinstance(each, (Task, Mapping)) for each in given)
    allowed = "must be a list of tasks, the path of a file of them or one of "
    require(right, "tasks", tasks, allowed + ", ".join(task_list_names()))
    found = tuple(each if isinstance(each, kind) else kind(**dict(each)) for each in given)
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


class FeedOptions(RewardOptions, total=False):
    """Options where tasks are given; every one may be left out."""

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
    component, way to lie, speed level and way to go; or ``discrete``: these as one number."""


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
        fidelity = options.get("fidelity", "dynamics")
        allowed = "must be 'dynamics', energy minimisation knows of no speed"
        require(fidelity == "dynamics", "fidelity", fidelity, allowed)
        scene = scene if isinstance(scene, Scene) else load_scene(scene)
        require(scene.mount == "tube", "scene.mount", scene.mount, "must be 'tube'")
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
        """Which of the templates each task has."""
        self.actions, self.layout = episodes.spaces(self, options)

    @cached_property
    def patterns(self) -> NDArray[np.int64]:
        """Pattern numbers of the available components, (tasks, parts)."""
        return np.array([[PATTERNS.index(faces) for faces in task.parts] for task in self.tasks])

    def number_of(self, value: int) -> int:
        """Return the number of a task; see `World.number_of`."""
        last = len(self.tasks) - 1
        require(value in range(last + 1), "options['task']", value, f"must be 0..{last}")
        return int(value)

    @cached_property
    def lattices(self) -> tuple[LatticeFeed, ...]:
        """What energy minimisation needs to know of the chains of each template."""
        return tuple(map(LatticeFeed, self.templates))
