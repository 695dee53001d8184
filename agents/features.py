"""What a network sees of a tube-fed chain: everything counted from the mouth of the tube."""

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch.nn.functional import one_hot, pad

from magfold_env.envs.observation import ObservationLayout

WIDTHS = {"magnets": 4, "speed": 1, "heading": 2, "rate": 1, "position": 2, "velocity": 2}
"""Groups of the observation that list components, and their entries for each."""


class FromTheMouth(BaseFeaturesExtractor):
    """Orders the observation of ``MagFold/TubeFeed-v0`` by the distance from the tube's mouth.

    The environment lists components from the chain's first to its last, so that the one that left
    the tube last is found at another place in every step. Here it always comes first and those
    before it follow, and the letters of the target are counted from the joint that folds next:
    what was learned at one joint holds at the others. The step is added, one-hot.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Box
        That of the environment, of ``17 n − 4`` entries.
    backward : bool
        Whether component ``n`` leaves the tube first.

    Raises
    ------
    ValueError
        If the observation is another one.
    """

    _order: torch.Tensor

    def __init__(self, observation_space: spaces.Box, backward: bool = False) -> None:
        n = (int(np.prod(observation_space.shape)) + 4) // 17
        layout = ObservationLayout(n, side=1.0)
        if observation_space.shape != (layout.size,):
            raise ValueError(
                f"observation_space: {observation_space} is not allowed; "
                "must be that of MagFold/TubeFeed-v0"
            )
        order = _order(layout, backward)
        super().__init__(observation_space, features_dim=sum(order.shape))
        self._released = layout.slices["released"]
        self.register_buffer("_order", torch.from_numpy(order), persistent=False)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the features, (batch, features_dim), of (batch, 17 n − 4) entries."""
        step = observations[:, self._released].sum(dim=1).round().long()
        ordered = pad(observations, (0, 1)).gather(1, self._order[step])
        return torch.cat((ordered, one_hot(step, len(self._order))), dim=1)


def _order(layout: ObservationLayout, backward: bool) -> NDArray[np.int64]:
    """Return for each step, 0 to n, which entries to take, in order: (n + 1, entries).

    What does not exist is numbered one beyond the last entry.
    """
    n = layout.n

    def group(name: str, width: int) -> NDArray[np.int64]:
        """Return the entries of a group, a row for each component or joint, in order of feed."""
        span = layout.slices[name]
        rows = np.arange(span.start, span.stop).reshape(-1, width)
        return rows[::-1] if backward else rows

    def pick(rows: NDArray[np.int64], places: NDArray[np.int64]) -> NDArray[np.int64]:
        exists = (places >= 0) & (places < len(rows))
        return np.where(exists[:, None], rows[places % len(rows)], layout.size).ravel()

    letters, angles = group("target", 3), group("joint", 1)
    components = [group(name, width) for name, width in WIDTHS.items()]
    steps: list[NDArray[np.int64]] = []
    for step in range(n + 1):
        # The joint that folds next lies between the component that is out and the next one.
        ahead = np.arange(step - 1, step + n - 2)
        behind = np.arange(step - 2, step - n - 1, -1)
        out = np.arange(step - 1, step - n - 1, -1)
        known = [pick(letters, ahead), pick(letters, behind), pick(angles, behind)]
        steps.append(np.concatenate(known + [pick(rows, out) for rows in components]))
    return np.array(steps)
