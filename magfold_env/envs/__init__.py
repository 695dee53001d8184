"""Gymnasium environments, registered under ``MagFold/`` when the package is imported.

===================== ========================== ==================== =================== =========
``MagFold/``          action                     observation          reward              horizon
===================== ========================== ==================== =================== =========
``TubeFeed-v0``       magnets and speed of the   ``Box``, 17 n − 4    score − b,          n steps
                      next component                                  at the end
``SequenceDesign-v0`` magnets of all components, ``Box``, 17 n − 4    score − b           1 step
                      one speed
``TubeFeedGoal-v0``   as ``TubeFeed``            ``Dict``: 14 n − 1,  −1, or 0 while the  n steps
                                                 and goals of n       goal is achieved
``UnknownFloor-v0``   feed speed, ahead or       ``Box``, 12 n + 2    score at the end,   250 steps
                      back, for the next 20 ms                        less 0.02 a second  (5 s)
``Reprogram-v0``      as ``UnknownFloor``        ``Box``, 12 n + 5    half the words      500 steps
                                                                      reached, less 0.02  (10 s)
                                                                      a second
``Lumen-v0``          as ``UnknownFloor``        ``Box``, 12 n + 2    score at the end,   250 steps
                                                                      less 0.02 a second  (5 s)
``Tray-v0``           a component, orientation   ``Box``, 21 n + 28   score at the end,   10 s
                      and speed; or draw the                          less 0.02 a second
                      last component back
``Anchor-v0``         as ``Tray``, or test the   ``Box``, 18 n + 34   score at the end,   10 s
                      pull                                            less 0.02 a second
===================== ========================== ==================== =================== =========

n is the number of components, 6 by default; b is the score of the energy minimiser's own design.
The docstrings of the classes explain every entry.

**Versions.** The number at the end of an id changes whenever the same seed and actions, with
default arguments, no longer give the same observations and rewards up to rounding: because the
physics, a default or the meaning of an entry has changed. A new option does not change it.
Baselines and evaluation draws have versions of their own (`baseline.PHYSICS_VERSION`,
`draws.EVALUATION_VERSION`).
"""

import gymnasium

ENTRY_POINTS = {
    "MagFold/TubeFeed-v0": "magfold_env.envs.tube_feed:TubeFeedEnv",
    "MagFold/SequenceDesign-v0": "magfold_env.envs.sequence_design:SequenceDesignEnv",
    "MagFold/TubeFeedGoal-v0": "magfold_env.envs.tube_feed_goal:TubeFeedGoalEnv",
    "MagFold/UnknownFloor-v0": "magfold_env.envs.unknown_floor:UnknownFloorEnv",
    "MagFold/Reprogram-v0": "magfold_env.envs.reprogram:ReprogramEnv",
    "MagFold/Lumen-v0": "magfold_env.envs.lumen:LumenEnv",
    "MagFold/Tray-v0": "magfold_env.envs.tray:TrayEnv",
    "MagFold/Anchor-v0": "magfold_env.envs.anchor:AnchorEnv",
}

VECTOR_ENTRY_POINTS = {
    env_id: f"{entry_point.removesuffix('Env')}VectorEnv"
    for env_id, entry_point in ENTRY_POINTS.items()
}


def register_envs() -> None:
    """Register every environment id with Gymnasium; a second call changes nothing."""
    for env_id, entry_point in ENTRY_POINTS.items():
        if env_id not in gymnasium.registry:
            # The horizon is part of the task, so no TimeLimit is added.
            gymnasium.register(  # pyright: ignore[reportUnknownMemberType]
                id=env_id,
                entry_point=entry_point,
                vector_entry_point=VECTOR_ENTRY_POINTS[env_id],
            )
