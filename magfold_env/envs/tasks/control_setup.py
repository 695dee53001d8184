"""What all episodes of feed control share: tasks, physics, observation and reward."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.dynamic_episode import dynamic_template
from magfold_env.envs.chains.quasistatic_episode import QuasistaticRules
from magfold_env.envs.control.episode import ControlEpisode
from magfold_env.envs.spaces.actions import FASTEST
from magfold_env.envs.spaces.observation import ObservationLayout, squash
from magfold_env.envs.spaces.speed_table import SpeedTable
from magfold_env.envs.tasks.checks import one_of, refuse_unknown, share_of
from magfold_env.envs.tasks.control_tasks import ControlTask, read_tasks
from magfold_env.envs.tasks.forecast import Forecast, forecast
from magfold_env.envs.tasks.goals import Goal, Match, goal_of
from magfold_env.envs.tasks.options import ControlOptions
from magfold_env.envs.tasks.randomisation import randomised
from magfold_env.envs.tasks.reward import RewardRule, energy_potential
from magfold_env.scene import Scene, load_scene

FORCE_SCALE = 1.0
"""Push that is shown as one half [N]."""

HORIZON = 250
"""Steps until an episode is truncated: 5 s."""

FEED = (("feed", 5),)
"""The group that only feed control shows; see `FeedControlEnv`."""


class ControlSetup:
    """Tasks and the world they are set in.

    Parameters
    ----------
    scene : str, Path or Scene
        A tube scene; sequence, direction and speeds come from the tasks and the agent.
    **options
        See `ControlOptions`.

    Raises
    ------
    ValueError
        For any option that is not allowed; the message names it and what is.
    """

    def __init__(self, scene: str | Path | Scene, **options: Unpack[ControlOptions]) -> None:
        refuse_unknown(options, ControlOptions)
        _refuse_misplaced(options)
        scene = scene if isinstance(scene, Scene) else load_scene(scene)
        if scene.mount != "tube":
            raise ValueError(f"scene.mount: {scene.mount!r} is not allowed; must be 'tube'")
        found = read_tasks(options.get("tasks", "two-folds-6"))
        share = share_of("difficulty", options.get("difficulty", 1.0))
        self.tasks = found[: math.ceil(share * len(found) - 1e-9)]
        self.scene = randomised(
            scene.replace(sequence=found[0].sequence, start_angles=None),
            options.get("randomisation", "nominal"),
        )
        self.match: Match = one_of("match", options.get("match", "word"), Match)
        self.actions = SpeedTable(options.get("speeds", 9), options.get("actions", "discrete"))
        self.rule = RewardRule.of(
            options.get("reward", "score"),
            options.get("shaping", False),
            options.get("gamma", 1.0),
        )
        self.push_limit = options.get("push_limit", 1.0)
        self.layout = ObservationLayout(
            self.scene.n, scene.casing.side, words=("target", "avoid"), extra=FEED
        )
        # No functools.cache: environments are pickled.
        self._templates: dict[ControlTask, Scene] = {}
        self._rules: dict[ControlTask, QuasistaticRules] = {}

    def pick(self, rng: np.random.Generator, options: Mapping[str, Any] | None) -> ControlTask:
        """Draw the task of an episode, or take that of the options of `reset`.

        One number is drawn in any case, so that a seed gives one physics whatever the task.

        Raises
        ------
        ValueError
            For an unknown option, or a number that no task has.
        """
        options = options or {}
        unknown = sorted(set(options) - {"task"})
        if unknown:
            raise ValueError(f"options: {unknown[0]!r} is not allowed; must be 'task'")
        drawn = int(rng.integers(len(self.tasks)))
        number = options.get("task", drawn)
        if number not in range(len(self.tasks)):
            raise ValueError(
                f"options['task']: {number!r} is not allowed; must be 0..{len(self.tasks) - 1}"
            )
        return self.tasks[int(number)]

    def begin(self, task: ControlTask, rng: np.random.Generator) -> ControlEpisode:
        """Return a new chain; all that is random about it is drawn here."""
        return ControlEpisode(self._template(task).draw(rng), self.push_limit)

    def goals(self, task: ControlTask) -> tuple[Goal, Goal]:
        """Return the fold to reach and the one to avoid."""
        return goal_of(task.target, self.match), goal_of(task.avoid, self.match)

    def potential(self, episode: ControlEpisode, task: ControlTask) -> float:
        """Return Φ of the shaping for a chain as it is, 0 at its end."""
        if self.rule.shaping is None or episode.status is not None:
            return 0.0
        if self.rule.shaping == "similarity":
            return self.goals(task)[0].potential(episode.state.joint_angles)
        return energy_potential(episode.energy, self._energy_as_target(task, episode))

    def forecast(self, episode: ControlEpisode, task: ControlTask) -> Forecast | None:
        """Return what energy minimisation says of the whole chain; None in an external field."""
        if self.scene.field is not None and self.scene.field.any:
            return None
        rules = self._rules_of(task)
        return forecast(rules, task.sequence, episode.progress, self.scene.n, task.target)

    def summary(self, episode: ControlEpisode, task: ControlTask) -> dict[str, Any]:
        """Return the info of an episode: the little there is on its way, all at its end."""
        info: dict[str, Any] = {
            "target": task.target,
            "avoid": task.avoid,
            "word": episode.word,
            "time": episode.time,
            "force": episode.force,
        }
        if episode.status is not None:
            goal, other = self.goals(task)
            status, joints = episode.fold_status, episode.state.joint_angles
            avoided = not other.is_reached(status, joints)
            info |= {
                "status": episode.status,
                "message": episode.message,
                "energy": episode.energy,
                "score": goal.score(status, joints) if avoided else 0.0,
                "is_success": goal.is_reached(status, joints),
            }
        return info

    def observe(self, episode: ControlEpisode, words: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the observation of a chain; `words` are the entries of the two folds."""
        last = episode.asked[-1] if episode.asked else 0.0
        feed = (
            1.0 if episode.progress.order[0] == 0 else -1.0,
            episode.out_of_next,
            last / FASTEST,
            squash(episode.force / FORCE_SCALE),
            len(episode.asked) / HORIZON,
        )
        return self.layout.observe(episode.state, episode.progress, words, feed)

    def _template(self, task: ControlTask) -> Scene:
        """Return the scene that episodes of a task are drawn from."""
        if task not in self._templates:
            scene = self.scene.replace(sequence=task.sequence, feed={"direction": task.direction})
            self._templates[task] = dynamic_template(scene)
        return self._templates[task]

    def _energy_as_target(self, task: ControlTask, episode: ControlEpisode) -> float:
        """Return the energy [J] of the components that act, in the target's shape."""
        return self._rules_of(task).energy_as(task.target, episode.progress, episode.acting)

    def _rules_of(self, task: ControlTask) -> QuasistaticRules:
        if task not in self._rules:
            self._rules[task] = QuasistaticRules(self._template(task))
        return self._rules[task]


def _refuse_misplaced(options: Mapping[str, Any]) -> None:
    """Refuse what the other environments have and this one cannot have."""
    if options.get("fidelity", "dynamics") != "dynamics":
        raise ValueError(
            f"fidelity: {options['fidelity']!r} is not allowed; must be 'dynamics', "
            "energy minimisation knows of no speed"
        )
    if options.get("reward") == "relative":
        raise ValueError(
            "reward: 'relative' is not allowed; must be score or sparse, "
            "there is no baseline for a chain that is given"
        )
    limit = options.get("push_limit")
    if limit is not None and not limit > 0.0:
        raise ValueError(f"push_limit: {limit!r} is not allowed; must be above 0, or None for none")
