"""``MagFold/UnknownFloor-v0``: feed a given chain back and forth over an unknown floor."""

from typing import Any

from magfold_env.envs.baselines.constant_speed import ConstantSpeedStore
from magfold_env.envs.camera_track import INTERVAL, STEEPEST, FeedEpisodes, FeedTrackEnv
from magfold_env.envs.vector_env import ChainVectorEnv

HORIZON = 250
"""Number of steps allowed in an episode: 5 s."""


class FloorEpisodes(FeedEpisodes):
    """Episodes with one target fold."""

    horizon = HORIZON
    store = ConstantSpeedStore
    protocol = (INTERVAL, HORIZON, STEEPEST)


class UnknownFloorEnv(FeedTrackEnv):
    """Feed a chain back and forth so that it folds into a target on a floor of unknown friction.

    `reset` selects a task: a sequence, a feed direction and a target. It draws and hides the
    friction of the floor (log-uniform from 0.05 to 1), the strength of all magnets together (±30 %)
    and of each (±15 %), the ratio of actual to requested feed speed (±60 %), and the offsets of the
    hinges in the tube. Each step sets the feed speed for the next 20 ms. Magnets act only outside
    the tube. The tube is 1.3 diagonals wide, so most folded chains can be drawn in and held again.
    Two casings do not fit side by side, so a fold opens when it is drawn in. Until the last
    component is out, a wrong fold can be drawn in and released again.

    **End**: when all components are out and at rest; when the drive has slipped for 0.1 s (status
    ``jammed``); after 250 steps, 5 s (``unsettled``); or when the simulation breaks down. Each of
    these terminates the episode, because the time is part of the task.

    **Action**: ``Box(−1, 1, (1,))``: x requests the speed ``0.6 x |x|`` m/s. Negative speeds pull
    the chain back. The feed stands still below 0.025 m/s (``|x| < 0.204``).
    ``env.unwrapped.actions.encode(speed)`` returns the action for a speed [m/s]. The feed speed
    changes by at most 0.2 m/s per step. `magfold_env.envs.spaces.actions.SpeedTable` lists the
    other forms.

    **Observation**: ``12 n + 2`` entries: ``target``, ``magnets``, ``direction``, then the groups
    below, with ``heading`` and ``position`` after ``seen``, and ``speed`` (as commanded) and
    ``force`` after ``advance``.

    ======= ======= ======================================================================= ======
    group   entries meaning and unit                                                        range
    ======= ======= ======================================================================= ======
    seen    n       1 if the camera sees a component: the tube does not hold it and its     0, 1
                    centre is outside. This, heading and position are 20 ms old
    advance 1       position of the feed, in chain lengths; 1 if all components are out     [0, 1]
    time    1       elapsed time, in units of 5 s                                           [0, 1]
    ======= ======= ======================================================================= ======

    `magfold_env.envs.camera_track.CameraTrackEnv` describes the other groups.

    **Reward** and **info** are those of that class. b is the score of the best constant speed
    (`magfold_env.envs.baselines.constant_speed`).

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    make_episodes = FloorEpisodes
    default_scene = "unknown-floor"
    default_tasks = "two-folds-6-v1"


UnknownFloorVectorEnv = ChainVectorEnv[Any].of(UnknownFloorEnv)
