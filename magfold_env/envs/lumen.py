"""``MagFold/Lumen-v0``: fold a given chain in an unknown chamber."""

from typing import Any

from magfold_env.envs.camera_track import FeedTrackEnv
from magfold_env.envs.unknown_floor import FloorEpisodes
from magfold_env.envs.vector_env import ChainVectorEnv


class LumenEnv(FeedTrackEnv):
    """Feed a chain into a chamber of unknown width and position so that it folds into a target.

    Action (x requests ``0.6 x |x|`` m/s), observation, ends, reward, info and options are those of
    `magfold_env.envs.unknown_floor.UnknownFloorEnv`. The tube opens into a chamber. Besides the
    floor and the magnets, `reset` draws and hides the width of the chamber and its offset from the
    tube's axis. An agent can infer the walls from the force that the feed needs and from where
    components stop. The scene's ``obstacles`` define the chamber; ``spreads`` define the draws.

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    make_episodes = FloorEpisodes
    default_scene = "lumen"
    default_tasks = "chamber-6"


LumenVectorEnv = ChainVectorEnv[Any].of(LumenEnv)
