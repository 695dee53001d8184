"""``MagFold/Lumen-v0``: fold a given chain in a chamber that is not known."""

from typing import Any

from magfold_env.envs.feed_track import FeedTrackEnv
from magfold_env.envs.unknown_floor import FloorEpisodes
from magfold_env.envs.vector_env import ChainVectorEnv


class LumenEnv(FeedTrackEnv):
    """Feed a chain into a chamber so that it folds into a target; the chamber is not known.

    As `magfold_env.envs.unknown_floor.UnknownFloorEnv`, with its action, observation, ends, reward,
    info and options, but for this: the tube opens into a chamber, and `reset` draws, besides the
    floor and the magnets, how wide the chamber is and how far to one side of the tube it lies. They
    are hidden as the rest is: walls are felt by the force that the feed needs, and seen where
    components cannot go on. The scene's obstacles are the chamber, its `spreads` say what is drawn.

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    make_episodes = FloorEpisodes
    default_scene = "lumen"
    default_tasks = "chamber-6"


LumenVectorEnv = ChainVectorEnv[Any].of(LumenEnv)
