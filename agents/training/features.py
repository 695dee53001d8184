"""Features of a tube-fed chain, counted from the mouth of the tube.

The stored state of training runs contains this module's name, so the module must not move.
"""

from collections.abc import Mapping

import numpy as np
import torch
from gymnasium import Space, spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch.nn.functional import one_hot, pad

from magfold_env.envs.spaces.observation import chain_layout
from magfold_env.envs.wrappers.mouth_order import LETTERS, mouth_order


class FromTheMouth(BaseFeaturesExtractor):
    """Reorders observations of ``TubeFeed``, as `magfold_env.envs.wrappers.mouth_order` does.

    Reordering is part of the network, so that hindsight can replace goals before it, and the policy
    plays the unchanged environment.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Box or gymnasium.spaces.Dict
        Space of ``MagFold/TubeFeed-v0`` or of ``MagFold/TubeFeedGoal-v0``.
    backward : bool
        Whether component ``n`` leaves the tube first.

    Raises
    ------
    ValueError
        If the space is a different one.
    """

    _order: torch.Tensor

    def __init__(self, observation_space: Space[object], backward: bool = False) -> None:
        # The target is given by its letters, one-hot, or by the target angles of the joints.
        if isinstance(observation_space, spaces.Dict):
            n, width = int(np.prod(observation_space["desired_goal"].shape or 0)), 1
            size = int(np.prod(observation_space["observation"].shape or 0)) + n - 1
        else:
            size, width = int(np.prod(observation_space.shape or 0)), LETTERS
            n = (size + 4) // 17
        self.width = width
        self._layout = chain_layout(n, side=1.0, words=())
        if size != self._layout.size + width * (n - 1):
            raise ValueError(
                f"observation_space: {observation_space} is not allowed; "
                "must be that of MagFold/TubeFeed-v0 or MagFold/TubeFeedGoal-v0"
            )
        order = mouth_order(n, width, backward)
        super().__init__(observation_space, features_dim=sum(order.shape))
        self.register_buffer("_order", torch.from_numpy(order), persistent=False)

    def forward(self, observations: torch.Tensor | Mapping[str, torch.Tensor]) -> torch.Tensor:
        """Return the features, (batch, features_dim), of a batch of observations."""
        entries = self.entries(observations)
        return self.ordered(entries, self.step(entries))

    def entries(self, observations: torch.Tensor | Mapping[str, torch.Tensor]) -> torch.Tensor:
        """Return the target's entries, `width` per joint, then the chain's, (batch, entries)."""
        if isinstance(observations, torch.Tensor):
            return observations
        wanted = observations["desired_goal"][:, :-1]
        return torch.cat((wanted, observations["observation"]), dim=1)

    def step(self, entries: torch.Tensor) -> torch.Tensor:
        """Return the number of components that have left the tube, (batch,)."""
        chain = entries[:, entries.shape[1] - self._layout.size :]
        return chain[:, self._layout.slices["released"]].sum(dim=1).round().long()

    def ordered(self, entries: torch.Tensor, step: torch.Tensor) -> torch.Tensor:
        """Return the entries counted from the mouth, then the step, one-hot."""
        ordered = pad(entries, (0, 1)).gather(1, self._order[step])
        return torch.cat((ordered, one_hot(step, len(self._order))), dim=1)
