"""Gymnasium environments, registered under ``MagFold/`` when the package is imported."""

import gymnasium

ENTRY_POINTS = {"MagFold/TubeFeed-v0": "magfold_env.envs.tube_feed:TubeFeedEnv"}


def register_envs() -> None:
    """Register every environment id with Gymnasium; a second call changes nothing."""
    for env_id, entry_point in ENTRY_POINTS.items():
        if env_id not in gymnasium.registry:
            # The horizon is part of the task (one step a component), so no TimeLimit is added.
            gymnasium.register(  # pyright: ignore[reportUnknownMemberType]
                id=env_id, entry_point=entry_point
            )
