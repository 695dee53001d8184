"""An agent's observations of a chain on a web page, and the chain's distance from its target.

The kernels of `magfold_env.envs` compute both, for a single chain.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.browser.view import RELEASED, View
from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array, IntArray, Model
from magfold_env.engine.workspace import zeros
from magfold_env.envs.chains.arrays import ChainArrays, component
from magfold_env.envs.spaces.observation import fill_chain, take_frames
from magfold_env.envs.tasks import goals


@by_pointer
class Episode(NamedTuple):
    """An episode of one chain of n components, component 1 first."""

    arrays: ChainArrays  # of this one chain
    row: Annotated[IntArray, 1]  # the chain's number, 0
    noise: Annotated[Array, 1, "3 n"]  # standard normal numbers, for each heading, x and y
    frames: Annotated[Array, 1, "5 n"]  # the camera's frame
    entries: Annotated[NDArray[np.float32], "14 n - 1"]  # observation for choosing magnets
    letter: Annotated[IntArray, "n"]  # of the target word: 1 L, 0 S, −1 R; the last is unused
    words: Annotated[IntArray, 1]  # number of target words, 1
    wanted: Annotated[Array, 1, 1, "n - 1"]  # the target's joint angles
    fold: Annotated[Array, 1, 1, "n"]  # headings [rad]
    joint: Annotated[Array, 1, "n - 1"]  # scratch: the chain's joint angles [rad]
    scratch: Annotated[Array, 5, "n"]
    judged: Annotated[Array, 3, 1]  # potential, score and success


def new_episode(n: int) -> Episode:
    """Allocate an episode."""
    sizes = {"n": n, "n - 1": n - 1, "3 n": 3 * n, "5 n": 5 * n, "14 n - 1": 14 * n - 1}
    one = np.ones(1, dtype=np.int64)
    return zeros(Episode, sizes, arrays=ChainArrays.empty(1, n), words=one)


@kernel
def take_in(forward: int, view: View, episode: Episode) -> None:
    """Copy the chain's state from a view that `view.look` has filled."""
    arrays = episode.arrays
    n = view.heading.size
    arrays.forward[0] = forward == 1
    for k in range(n):
        arrays.angles[0, k], arrays.rates[0, k] = view.heading[k], view.rate[k]
        place = component(forward == 1, k, n)
        arrays.released[0, place] = k < view.number[RELEASED]
    for axis in range(2):
        arrays.base[0, axis] = view.base[axis]
        arrays.base_velocity[0, axis] = view.velocity[axis]


@kernel
def observe(model: Model, episode: Episode) -> None:
    """Fill in the observation for choosing the next component's magnets."""
    fill_chain(model.side, episode.arrays, 0, episode.entries)


@kernel
def film(model: Model, episode: Episode) -> None:
    """Fill in a camera's view of the chain, with noise."""
    take_frames(model.side, episode.row, episode.arrays, episode.noise, episode.frames)


@kernel
def judge(episode: Episode) -> None:
    """Fill in the chain's potential, score and success, given its status in ``arrays.status``."""
    angles = episode.arrays.angles
    for k in range(episode.joint.size):
        turn = float(episode.letter[k]) * (math.pi / 2.0)
        episode.wanted[0, 0, k] = turn
        episode.fold[0, 0, k + 1] = episode.fold[0, 0, k] + turn
        episode.joint[0, k] = angles[0, k + 1] - angles[0, k]
    goals.judge(
        episode.row, episode.arrays.status, episode.joint, episode.words, episode.wanted,
        episode.fold, episode.scratch, episode.judged,
    )  # fmt: skip
