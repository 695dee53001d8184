"""A folding task: scene, targets, actions, observation and reward, put together from options.

It holds all that the chains of one environment share and no chain itself, so that one chain or
many can be run on it.
"""

from collections.abc import Mapping
from functools import cached_property
from itertools import cycle, islice
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.designer.suites import Suite, load_suite, suite_names
from magfold_env.envs.baselines.baseline import Baseline, unknown_baseline
from magfold_env.envs.baselines.baseline_store import BaselineStore
from magfold_env.envs.chains.dynamic_episode import DynamicEpisode, dynamic_template
from magfold_env.envs.chains.episode import Episode, EpisodeView
from magfold_env.envs.chains.quasistatic_episode import QuasistaticEpisode, QuasistaticRules
from magfold_env.envs.spaces.action_reading import read_catalogue
from magfold_env.envs.spaces.action_table import ActionTable
from magfold_env.envs.spaces.observation import ObservationLayout
from magfold_env.envs.tasks.checks import one_of, refuse_unknown
from magfold_env.envs.tasks.difficulty import easiest
from magfold_env.envs.tasks.forecast import Forecast, forecast
from magfold_env.envs.tasks.goals import Goal, Match, goal_of
from magfold_env.envs.tasks.options import Fidelity, FoldOptions
from magfold_env.envs.tasks.randomisation import randomised
from magfold_env.envs.tasks.reward import RewardRule, energy_potential
from magfold_env.envs.tasks.targets import pick_target, resolve_targets
from magfold_env.scene import Scene, load_scene


class FoldTask:
    """What is to be folded, and how it is chosen, seen and rewarded.

    Parameters
    ----------
    scene : str, Path, Scene or None
        A tube scene: a shipped name, a path or the scene. Its sequence and feed speeds are the
        agent's to choose and so are ignored: every face gets a magnet. None takes `usual`, or
        what the target suite is meant for, fed as `usual` is.
    usual : str
        The shipped scene that the environment has by default.
    at_a_time : {"component", "chain"}
        What one action describes.
    **options
        See `FoldOptions`.

    Raises
    ------
    ValueError
        For any option that is not allowed; the message names it and what is.
    """

    def __init__(
        self,
        scene: str | Path | Scene | None,
        usual: str,
        at_a_time: Literal["component", "chain"],
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
        given = feedable(lengthened(given, components), at_a_time)
        self.fidelity: Fidelity = one_of("fidelity", options.get("fidelity", "dynamics"), Fidelity)
        self.match: Match = one_of("match", options.get("match", "word"), Match)
        self.scene = randomised(given, options.get("randomisation", "nominal"))
        self.targets = easiest(
            self.scene, resolve_targets(targets, given.n), options.get("difficulty", 1.0)
        )
        self.actions = ActionTable(
            options.get("speeds", 9),
            1 if at_a_time == "component" else given.n,
            options.get("actions", "multidiscrete"),
            read_catalogue(options.get("catalogue")),
        )
        self.layout = ObservationLayout(given.n, given.casing.side)
        self.rule = RewardRule.of(
            options.get("reward", "relative"),
            options.get("shaping", False),
            options.get("gamma", 1.0),
        )
        baseline = options.get("baseline", "auto")
        if baseline not in ("auto", None):
            raise ValueError(f"baseline: {baseline!r} is not allowed; must be 'auto' or None")
        wanted = baseline == "auto" and self.rule.kind == "relative"
        self._baselines = None
        if wanted and self.fidelity == "dynamics":
            if given.field is not None and given.field.any:
                raise ValueError(
                    "baseline: 'auto' is not allowed with scene.field; energy minimisation does "
                    "not know of external fields, must be None"
                )
            self._baselines = BaselineStore(self.scene, self.match)
        if self.fidelity == "quasistatic" or self.rule.shaping == "energy":
            _ = self.rules

    @cached_property
    def rules(self) -> QuasistaticRules:
        """The energies of the chain on the lattice."""
        return QuasistaticRules(self.scene)

    @cached_property
    def template(self) -> Scene:
        """What simulated episodes are drawn from."""
        return dynamic_template(self.scene)

    def pick(self, rng: np.random.Generator, options: Mapping[str, Any] | None) -> Goal:
        """Draw the target of an episode, or take that of the options of `reset`.

        One number is drawn in any case, so that a seed gives one physics whatever the target.

        Raises
        ------
        ValueError
            For an unknown option or a target that is not among the task's.
        """
        options = options or {}
        unknown = sorted(set(options) - {"target"})
        if unknown:
            raise ValueError(f"options: {unknown[0]!r} is not allowed; must be 'target'")
        drawn = self.targets[int(rng.integers(len(self.targets)))]
        return goal_of(pick_target(options.get("target", drawn), self.targets), self.match)

    def begin(self, rng: np.random.Generator, frame_rate: float | None = None) -> Episode:
        """Return a new chain; all that is random about it is drawn here.

        With a `frame_rate` [1/s] the episode records the motion of a simulated chain.
        """
        if self.fidelity == "quasistatic":
            return QuasistaticEpisode(self.rules)
        return DynamicEpisode(self.template, rng, frame_rate)

    def baseline_of(self, target: str) -> Baseline:
        """Return the energy minimiser's result for `target`; flagged where there is none.

        May take some seconds where neither the package nor the disk cache has it.
        """
        if self._baselines is None:
            return unknown_baseline(target)
        return self._baselines.get(target)

    def forecast(self, episode: EpisodeView, goal: Goal) -> Forecast | None:
        """Return what energy minimisation says of the components fed so far.

        None where it has nothing to say: before the first, in an external field, and where it is
        itself what happens.
        """
        in_field = self.scene.field is not None and self.scene.field.any
        if episode.fed == 0 or in_field or self.fidelity == "quasistatic":
            return None
        sequence = episode.scene_so_far.sequence
        return forecast(self.rules, sequence, episode.progress, episode.fed, goal.word)

    def potential(self, episode: EpisodeView, goal: Goal) -> float:
        """Return Φ of the shaping for a chain as it is, 0 at its end."""
        if self.rule.shaping is None or episode.status is not None:
            return 0.0
        if self.rule.shaping == "similarity":
            return goal.potential(episode.state.joint_angles)
        wanted = self.rules.energy_as(goal.word, episode.progress, episode.fed)
        return energy_potential(episode.energy, wanted)

    def summary(self, episode: EpisodeView, goal: Goal, baseline: Baseline) -> dict[str, Any]:
        """Return the info of an episode: the little there is on its way, all at its end."""
        info: dict[str, Any] = {"target": goal.word, "word": episode.word, "step": episode.fed}
        if episode.status is not None:
            joints = episode.state.joint_angles
            info |= {
                "status": str(episode.status),
                "message": episode.message,
                "energy": episode.energy,
                "score": goal.score(episode.status, joints),
                "baseline": baseline.score,
                "baseline_flagged": baseline.flagged,
                "is_success": goal.is_reached(episode.status, joints),
            }
        return info

    def observe(self, episode: EpisodeView, words: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the observation of a chain; `words` are the entries that say what is wanted."""
        return self.layout.observe(episode.state, episode.progress, words)


def lengthened(scene: Scene, components: int | None) -> Scene:
    """Return `scene` with a chain of another length, its components repeated as needed.

    Raises
    ------
    ValueError
        If there are fewer than two.
    """
    if components is None or components == scene.n:
        return scene
    if components <= 1:
        raise ValueError(f"components: {components!r} is not allowed; must be 2 or more")
    sequence = tuple(islice(cycle(scene.sequence), components))
    return scene.replace(sequence=sequence, start_angles=None)


def feedable(scene: Scene, at_a_time: Literal["component", "chain"]) -> Scene:
    """Return `scene` if the magnets of its chain can be chosen, and the chain fed.

    Raises
    ------
    ValueError
        If it has no tube, no magnets, a single component, or magnets that would act before they
        are chosen.
    """
    if scene.mount != "tube":
        raise ValueError(f"scene.mount: {scene.mount!r} is not allowed; must be 'tube'")
    if at_a_time == "component" and scene.feed.loading != "at_mouth":
        raise ValueError(
            f"scene.feed.loading: {scene.feed.loading!r} is not allowed; must be 'at_mouth', "
            "or magnets would act before they are chosen"
        )
    if scene.magnets is None:
        raise ValueError("scene.magnets: None is not allowed; must be given")
    if scene.n == 1:
        raise ValueError(
            f"scene.sequence: {scene.sequence} is not allowed; must have two components or more"
        )
    return scene


def _scene_of(suite: Suite, usual: Scene) -> Scene:
    """Return the scene of a suite, in the tube, with the loading and work cap of the usual one."""
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
    if name in suite_names() or Path(name).is_file():
        return load_suite(name)
    raise ValueError(
        f"targets: {name!r} is not allowed; must be a list of fold words, the path of a suite or "
        f"one of the suites {', '.join(suite_names())}"
    )
