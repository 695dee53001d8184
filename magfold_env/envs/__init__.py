"""Gymnasium environments, registered under ``MagFold/`` when the package is imported.

The classes' docstrings describe each environment; docs/environments/index.md compares them.

**Versions.** The number at the end of an id changes when the same seed and actions, with default
arguments, no longer give the same observations and rewards up to rounding, because the physics, a
default or an entry's meaning has changed. New options do not change the number. Baselines and
evaluation draws have their own versions (`baseline.PHYSICS_VERSION`, `draws.EVALUATION_VERSION`).
"""

from typing import Any

import gymnasium

ENTRY_POINTS = {
    "MagFold/TubeFeed-v0": "magfold_env.envs.tube_feed:TubeFeedEnv",
    "MagFold/SequenceDesign-v0": "magfold_env.envs.sequence_design:SequenceDesignEnv",
    "MagFold/TubeFeedGoal-v0": "magfold_env.envs.tube_feed_goal:TubeFeedGoalEnv",
    "MagFold/UnknownFloor-v0": "magfold_env.envs.unknown_floor:UnknownFloorEnv",
    "MagFold/UnknownFloor-v1": "magfold_env.envs.unknown_floor:UnknownFloorEnv",
    "MagFold/Reprogram-v0": "magfold_env.envs.reprogram:ReprogramEnv",
    "MagFold/Lumen-v0": "magfold_env.envs.lumen:LumenEnv",
    "MagFold/Tray-v0": "magfold_env.envs.tray:TrayEnv",
    "MagFold/Anchor-v0": "magfold_env.envs.anchor:AnchorEnv",
}

EARLIER: dict[str, dict[str, Any]] = {
    "MagFold/UnknownFloor-v0": {"tasks": "two-folds-6", "scene": "unknown-floor-v0"}
}
"""Arguments with which a class plays the tasks of an earlier version."""

VECTOR_ENTRY_POINTS = {
    env_id: f"{entry_point.removesuffix('Env')}VectorEnv"
    for env_id, entry_point in ENTRY_POINTS.items()
}


def register_envs() -> None:
    """Register every environment id with Gymnasium; a second call changes nothing."""
    for env_id, entry_point in ENTRY_POINTS.items():
        if env_id not in gymnasium.registry:
            # Horizons depend on options, so `chain_env.Limited` sets max_episode_steps.
            gymnasium.register(  # pyright: ignore[reportUnknownMemberType]
                id=env_id,
                entry_point=entry_point,
                vector_entry_point=VECTOR_ENTRY_POINTS[env_id],
                kwargs=EARLIER.get(env_id, {}),
            )
