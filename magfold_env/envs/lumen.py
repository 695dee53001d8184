"""``MagFold/Lumen-v0``: fold a given chain in a chamber that is not known."""

from pathlib import Path
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.feed_track import FeedTrackEnv
from magfold_env.envs.tasks.feed_tasks import ChamberWorld, FeedOptions
from magfold_env.envs.unknown_floor import FloorEpisodes
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import Scene


class LumenEnv(FeedTrackEnv):
    """Feed a chain into a chamber so that it folds into a target; the chamber is not known.

    As `magfold_env.envs.unknown_floor.UnknownFloorEnv`, with its action, observation, ends, reward,
    info and options, but for this: the tube opens into a chamber, and `reset` draws, besides the
    floor and the magnets, how wide the chamber is and how far to one side of the tube it lies. They
    are hidden as the rest is: walls are felt by the force that the feed needs, and seen where
    components cannot go on. The scene's obstacles are the chamber, its `spreads` say what is drawn.

    Parameters
    ----------
    scene : str, Path or Scene
        A tube scene; its sequence, direction and speeds are ignored.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.
    **options
        See `magfold_env.envs.tasks.feed_tasks.FeedOptions`.

    Raises
    ------
    ValueError
        For any argument that is not allowed; the message names it and what is.
    """

    make_episodes = FloorEpisodes

    def __init__(
        self,
        scene: str | Path | Scene = "lumen",
        *,
        render_mode: str | None = None,
        **options: Unpack[FeedOptions],
    ) -> None:
        super().__init__(ChamberWorld(scene, **options), render_mode)


class LumenVectorEnv(ChainVectorEnv[NDArray[np.float32]]):
    """Many of `LumenEnv`.

    Arguments are those of `magfold_env.envs.vector_env.ChainVectorEnv`.
    """

    single = LumenEnv
