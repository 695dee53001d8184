"""A folding task: scene, targets, actions, observation and reward, put together from options."""

from itertools import cycle, islice
from pathlib import Path
from typing import Literal, Unpack

from magfold_env.designer.suites import Suite, load_suite, suite_names
from magfold_env.envs.baselines.baseline import Baseline, BaselineStore, unknown_baseline
from magfold_env.envs.spaces.actions import ActionTable, read_catalogue
from magfold_env.envs.spaces.observation import ObservationLayout
from magfold_env.envs.tasks.checks import refuse_unknown, require, whole
from magfold_env.envs.tasks.targets import easiest, resolve_targets
from magfold_env.envs.tasks.world import FoldOptions, World
from magfold_env.scene import Scene, load_scene


class FoldTask(World):
    """A folding task: the fold, the choices, the observations and the rewards.

    Parameters
    ----------
    scene : str, Path, Scene or None
        A tube scene: a shipped name, a path or the scene. Its sequence and feed speeds are ignored,
        because the agent chooses them and every face gets a magnet. None takes `usual`, or the
        scene that the target suite is meant for, with the feed of `usual`.
    usual : str
        The default scene of the environment, a shipped one.
    action_scope : {"component", "chain"}
        Scope of one action.
    **options
        See `FoldOptions`.

    Raises
    ------
    ValueError
        If an option is not allowed; the message names it and the allowed values.
    """

    def __init__(
        self,
        scene: str | Path | Scene | None,
        usual: str,
        action_scope: Literal["component", "chain"],
        **options: Unpack[FoldOptions],
    ) -> None:
        refuse_unknown(options, FoldOptions)
        targets = options.get("targets")
        components = options.get("components")
        if isinstance(targets, str):
            suite = _suite(targets)
            targets, components = suite.targets, components or suite.n
            scene = _scene_of(suite, load_scene(usual)) if scene is None else scene
        scene = usual if scene is None else scene
        given = scene if isinstance(scene, Scene) else load_scene(scene)
        given = feedable(lengthened(given, components), action_scope)
        self.action_scope = action_scope
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
        self.layout = ObservationLayout(given.n, given.casing.side)
        baseline = options.get("baseline", "auto")
        require(baseline in ("auto", None), "baseline", baseline, "must be 'auto' or None")
        wanted = baseline == "auto" and self.rule.kind == "relative"
        self._baselines = None
        if wanted and self.fidelity == "dynamics":
            if self.in_field:
                raise ValueError(
                    "baseline: 'auto' is not allowed with scene.field; energy minimisation does "
                    "not know of external fields, must be None"
                )
            self._baselines = BaselineStore(self.scene, self.match)
        if self.fidelity == "quasistatic" or self.rule.shaping == "energy":
            _ = self.lattice

    def baseline_of(self, target: str) -> Baseline:
        """Return the energy minimiser's result for `target`; it is flagged if there is none.

        May take some seconds where neither the package nor the disk cache has it.
        """
        if self._baselines is None:
            return unknown_baseline(target)
        return self._baselines.get(target)


def lengthened(scene: Scene, components: int | None) -> Scene:
    """Return `scene` with a chain of another length, its components repeated as needed.

    Raises
    ------
    ValueError
        If the length is not a whole number of 2 or more.
    """
    if components is None or whole("components", components, 2) == scene.n:
        return scene
    sequence = tuple(islice(cycle(scene.sequence), components))
    return scene.replace(sequence=sequence, start_angles=None)


def feedable(scene: Scene, action_scope: Literal["component", "chain"]) -> Scene:
    """Return `scene` if its magnets can be chosen and its chain can be fed.

    Raises
    ------
    ValueError
        If it has no tube, no magnets, only one component, or magnets that act before they are
        chosen.
    """
    loading = scene.feed.loading
    late = action_scope == "chain" or loading == "at_mouth"
    allowed = "must be 'at_mouth', or magnets would act before they are chosen"
    require(scene.mount == "tube", "scene.mount", scene.mount, "must be 'tube'")
    require(late, "scene.feed.loading", loading, allowed)
    require(scene.magnets is not None, "scene.magnets", None, "must be given")
    require(scene.n > 1, "scene.sequence", scene.sequence, "must have two components or more")
    return scene


def _scene_of(suite: Suite, usual: Scene) -> Scene:
    """Return the scene of a suite in the tube, with the loading and work limit of the usual one."""
    return suite.scene().replace(
        mount="tube",
        feed={"loading": usual.feed.loading},
        solver={"max_steps": usual.solver.max_steps},
    )


def _suite(name: str) -> Suite:
    """Return the suite that the option `targets` names.

    Raises
    ------
    ValueError
        If there is none.
    """
    names = suite_names()
    allowed = "must be a list of fold words, the path of a suite or one of the suites "
    right = name in names or Path(name).is_file()
    require(right, "targets", name, allowed + ", ".join(names))
    return load_suite(name)
