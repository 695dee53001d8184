"""What all episodes of an environment share, and the options that define it."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import cycle, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypedDict, Unpack, get_args

import numpy as np
from numpy.typing import NDArray

from magfold_env.designer.suites import Suite, load_suite, suite_names
from magfold_env.envs.baselines.baseline import Baseline, BaselineStore, unknown_baseline
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.spaces.actions import PATTERNS, ActionKind, ActionTable, read_catalogue
from magfold_env.envs.spaces.observation import Layout, chain_layout
from magfold_env.envs.tasks.checks import one_of, refuse_unknown, require, whole
from magfold_env.envs.tasks.draws import Randomisation, randomised
from magfold_env.envs.tasks.feed_tasks import Task, read_tasks
from magfold_env.envs.tasks.goals import Match
from magfold_env.envs.tasks.reward import RewardKind, RewardRule, Shaping
from magfold_env.envs.tasks.symmetry import Split
from magfold_env.envs.tasks.targets import easiest, pick_target, resolve_targets
from magfold_env.scene import Scene, load_scene
from magfold_env.scene.errors import refuse, unless_one_of, unless_positive

if TYPE_CHECKING:
    from magfold_env.envs.camera_track import CameraEpisodes

Fidelity = Literal["dynamics", "quasistatic"]
Sight = Literal["camera", "exact", "none"]
Reveal = Literal["physics"]


class Setup:
    """The scene, targets, actions, observations and rewards that all episodes share.

    This class reads the options ``fidelity``, ``match``, ``randomisation`` and those of
    `RewardOptions`. The arguments `randomisation` and `reward` apply if those options are missing.
    """

    option: ClassVar[tuple[str, type]] = ("target", str)
    """The option of `reset` that fixes the target or task, and the type of its value."""

    words: tuple[str, ...]
    """The target words that `reset` draws from, or those of the tasks."""
    actions: Any
    """Encoding and decoding of actions: an `ActionTable`, `SpeedTable` or `TrayTable`."""
    layout: Layout
    """The slice of each group of entries in an observation."""

    def __init__(
        self,
        scene: Scene,
        options: Mapping[str, Any],
        randomisation: Randomisation = "nominal",
        reward: RewardKind = "score",
    ) -> None:
        self.fidelity: Fidelity = one_of("fidelity", options.get("fidelity", "dynamics"), Fidelity)
        self.match: Match = one_of("match", options.get("match", "word"), Match)
        self.randomisation: Randomisation = options.get("randomisation", randomisation)
        self.scene = randomised(scene, self.randomisation)
        """The scene that episodes are drawn from, including the randomisation."""
        self.rule = RewardRule.of(
            options.get("reward", reward), options.get("shaping", False), options.get("gamma", 1.0)
        )

    @property
    def in_field(self) -> bool:
        """Whether an external field acts, which energy minimisation does not include."""
        return self.scene.field is not None and self.scene.field.any

    @cached_property
    def lattice(self) -> LatticeFeed:
        """The rules by which energy minimisation folds the chain."""
        return LatticeFeed(self.scene)

    def number_of(self, value: Any) -> int:
        """Return the number of the target or task that the `value` of the option selects."""
        return self.words.index(pick_target(value, self.words))


class SharedOptions(TypedDict, total=False):
    """Options of all environments; all are optional."""

    match: Match
    """``word``: the fold must be the target. ``outline``: it must cover the same cells, in any
    order (`magfold_env.shapes.outline`)."""
    difficulty: float
    """Share of the targets or tasks to draw from, easiest first: above 0, at most 1 (default)."""
    fidelity: Fidelity
    """``dynamics`` (default): the chain is simulated. ``quasistatic``, only where the agent
    chooses magnets: energy decides each joint; no speed, friction, draws or baseline."""
    randomisation: Randomisation
    """Physics drawn at reset. ``none``: no draws, a straight chain, sound magnets. ``nominal``
    (default where the agent chooses magnets): friction ±10 %, remanence ±5 %, speed of each
    component ±5 %, release angles ±0.03 rad. ``strong``: ±30 %, ±10 %, ±20 % and ±0.1 rad;
    the tube may limit angles. ``scene`` (default where tasks are given): the scene's spreads."""
    speeds: int
    """Number of speed levels. The default is 9 where the agent chooses magnets, which includes the
    baseline's five speeds, and 5 where tasks are given. Where the agent sets only the speed, this
    is the number in each direction, without standstill."""
    actions: ActionKind
    """Form of actions. ``multidiscrete``: whole numbers, such as the magnet pattern and the speed
    level. ``discrete``: one number for all of these, with at most a million values. ``box``:
    numbers from −1 to 1, four per component, above 0 for N, and the speed on a log scale. Where the
    agent sets only the speed, ``box`` is the default: x means 0.6 x² m/s with the sign of x.
    Elsewhere ``multidiscrete`` is the default. Trays have no ``box``."""


class RewardOptions(TypedDict, total=False):
    """Options that set how episodes are rewarded."""

    reward: RewardKind
    """``relative``, ``score`` or ``sparse``; see `magfold_env.envs.tasks.reward`. The default is
    ``relative`` where the agent chooses magnets, and ``score`` where tasks are given."""
    shaping: bool | Shaping
    """Potential-based shaping: False (default), ``similarity`` (or True) or ``energy``."""
    gamma: float
    """Discount of the shaping, 1 by default; must equal the agent's discount."""


class ChainOptions(SharedOptions, total=False):
    """Options of environments where the agent chooses magnets, except those of the reward."""

    components: int | None
    """Chain length; by default that of the suite or the scene."""
    targets: Sequence[str] | str | None
    """Words to draw from at reset, or the name or path of a target suite
    (`magfold_env.designer.suites`), which also sets the chain length; by default every fully
    folded word of the chain."""
    catalogue: Sequence[str] | None
    """Components that can be built, such as ``["NSNS", "NNSS"]``; all 16 by default. The nearest
    of them replaces any other component, and `action_masks` excludes the others."""


class FoldOptions(ChainOptions, RewardOptions, total=False):
    """Options of environments where the agent chooses magnets."""

    baseline: Literal["auto"] | None
    """``auto`` (default): take b from the package data or the disk cache, or compute it. None: b is
    0."""


class FeedOptions(SharedOptions, RewardOptions, total=False):
    """Options of environments with given tasks."""

    tasks: str | Path | Sequence[Task | Mapping[str, Any]]
    """Name of a shipped list of tasks, path of a YAML file, or the tasks themselves; by default the
    environment's own list."""
    split: Split
    """The tasks to draw from if the list has two sides (`magfold_env.envs.tasks.symmetry`):
    ``train`` (default), ``test`` or ``all``."""
    sight: Sight
    """What the camera and the force sensor show. ``camera`` (default): frames, 20 ms old where the
    chain is given, and forces, with noise. ``exact``: the newest frame and the force, without
    noise. ``none``: 0. Draws, physics and the observation space are the same for all."""
    reveal: Reveal | None
    """``physics``: observations also contain the hidden draws, as the group ``physics``
    (`magfold_env.envs.camera_track.CameraTrackEnv`). None (default): they do not."""


class FoldTask(Setup):
    """A setup in which the agent chooses magnets, for a component or a chain at a time.

    The default scene is the shipped one named `usual` or, if a suite of targets is given, the
    suite's scene with the feed of `usual`.
    """

    def __init__(
        self,
        scene: str | Path | Scene | None,
        usual: str,
        action_scope: Literal["component", "chain"],
        **options: Unpack[FoldOptions],
    ) -> None:
        refuse_unknown(options, FoldOptions)
        targets, components = options.get("targets"), options.get("components")
        if isinstance(targets, str):
            suite = _suite(targets)
            targets, components = suite.targets, components or suite.n
            if scene is None:
                feed = load_scene(usual)
                scene = suite.scene().replace(
                    mount="tube",
                    feed={"loading": feed.feed.loading},
                    solver={"max_steps": feed.solver.max_steps},
                )
        scene = usual if scene is None else scene
        given = scene if isinstance(scene, Scene) else load_scene(scene)
        given = feedable(lengthened(given, components), action_scope)
        super().__init__(given, options, reward="relative")
        self.words = easiest(
            self.scene, resolve_targets(targets, given.n), options.get("difficulty", 1.0)
        )
        self.actions = ActionTable(
            options.get("speeds", 9),
            1 if action_scope == "component" else given.n,
            options.get("actions", "multidiscrete"),
            read_catalogue(options.get("catalogue")),
        )
        self.layout = chain_layout(given.n, given.casing.side)
        baseline = one_of("baseline", options.get("baseline", "auto"), ("auto", None))
        self._baselines = None
        wanted = baseline == "auto" and self.rule.kind == "relative"
        if wanted and self.fidelity == "dynamics":
            if self.in_field:
                raise ValueError(
                    "baseline: 'auto' is not allowed with scene.field, because energy minimisation "
                    "ignores external fields; must be None"
                )
            self._baselines = BaselineStore(self.scene, self.match)
        if self.fidelity == "quasistatic" or self.rule.shaping == "energy":
            _ = self.lattice

    def baseline_of(self, target: str) -> Baseline:
        """Return the energy minimiser's result for `target`; see `FoldEnv.baseline_of`."""
        if self._baselines is None:
            return unknown_baseline(target)
        return self._baselines.get(target)


def lengthened(scene: Scene, components: int | None) -> Scene:
    """Return `scene` with a chain of another length, its components repeated as needed."""
    if components is None or whole("components", components, 2) == scene.n:
        return scene
    sequence = tuple(islice(cycle(scene.sequence), components))
    return scene.replace(sequence=sequence, start_angles=None)


def feedable(scene: Scene, action_scope: Literal["component", "chain"]) -> Scene:
    """Return `scene`; raise an error if magnets cannot be chosen or the chain cannot be fed."""
    loading = scene.feed.loading
    late = action_scope == "chain" or loading == "at_mouth"
    allowed = "must be 'at_mouth', so that magnets do not act before they are chosen"
    require(scene.mount == "tube", "scene.mount", scene.mount, "must be 'tube'")
    require(late, "scene.feed.loading", loading, allowed)
    require(scene.magnets is not None, "scene.magnets", None, "must be given")
    require(scene.n > 1, "scene.sequence", scene.sequence, "must have two components or more")
    return scene


def _suite(name: str) -> Suite:
    """Return the suite that the option `targets` names."""
    names = suite_names()
    allowed = "must be a list of fold words, the path of a suite or one of the suites "
    right = name in names or os.path.isfile(name)
    require(right, "targets", name, allowed + ", ".join(names))
    return load_suite(name)


class TaskSetup(Setup):
    """A setup of given tasks; the class of its episodes defines actions and observations.

    The sequence, direction and speeds of `scene` are ignored. The option ``tasks`` is required.
    """

    option = ("task", int)

    def __init__(
        self,
        episodes: "type[CameraEpisodes]",
        scene: str | Path | Scene,
        **options: Unpack[FeedOptions],
    ) -> None:
        refuse_unknown(options, FeedOptions)
        fidelity = options.get("fidelity", "dynamics")
        allowed = "must be 'dynamics', because energy minimisation ignores speeds"
        require(not unless_one_of("", fidelity, ["dynamics"]), "fidelity", fidelity, allowed)
        scene = scene if isinstance(scene, Scene) else load_scene(scene)
        require(scene.mount == "tube", "scene.mount", scene.mount, "must be 'tube'")
        found = read_tasks(options.get("tasks", ()), episodes.task_kind, options.get("split"))
        share = options.get("difficulty", 1.0)
        refuse(unless_positive("difficulty", share, 1.0))
        self.tasks = found[: math.ceil(share * len(found) - 1e-9)]
        self.words = tuple(task.target for task in self.tasks)
        scene = scene.replace(sequence=found[0].parts[: found[0].n], start_angles=None)
        super().__init__(scene, options, randomisation="scene")
        directions = dict.fromkeys(task.direction for task in self.tasks)
        self.templates: tuple[Scene, ...] = tuple(
            self.scene.replace(feed={"direction": direction}) for direction in directions
        )
        """The scenes that episodes are drawn from, one per feed direction."""
        self.kinds: tuple[int, ...] = tuple(
            list(directions).index(task.direction) for task in self.tasks
        )
        """Index of each task's template."""
        self.sight: Sight = one_of("sight", options.get("sight", "camera"), Sight)
        self.actions, self.layout = episodes.spaces(self, options)
        if one_of("reveal", options.get("reveal"), (None, *get_args(Reveal))) is not None:
            sizes = {**self.layout.sizes, "physics": episodes.physics_size(self)}
            self.layout = replace(self.layout, sizes=sizes)

    @cached_property
    def patterns(self) -> NDArray[np.int64]:
        """Pattern numbers of the available components, (tasks, parts)."""
        return np.array([[PATTERNS.index(faces) for faces in task.parts] for task in self.tasks])

    @cached_property
    def lattices(self) -> tuple[LatticeFeed, ...]:
        """The rules by which energy minimisation folds the chains of each template."""
        return tuple(map(LatticeFeed, self.templates))

    def number_of(self, value: int) -> int:
        """Return the number of a task; see `Setup.number_of`."""
        return whole("options['task']", value, 0, len(self.tasks) - 1)
