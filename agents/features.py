"""What a network sees of a tube-fed chain: everything counted from the mouth of the tube.

The resume state of training runs names this module: it loads only while it is found here.
"""

from collections.abc import Mapping

import numpy as np
import torch
from gymnasium import Space, spaces
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch.nn.functional import one_hot, pad

from magfold_env.envs.spaces.observation import ObservationLayout

WIDTHS = {"magnets": 4, "speed": 1, "heading": 2, "rate": 1, "position": 2, "velocity": 2}
"""Groups of the observation that list components, and their entries for each."""


class FromTheMouth(BaseFeaturesExtractor):
    """Orders the observation of tube feed by the distance from the tube's mouth.

    The environment lists components from the chain's first to its last, so that the one that left
    the tube last is found at another place in every step. Here it always comes first and those
    before it follow, and what is wanted is counted from the joint that folds next: what was
    learned at one joint holds at the others. The step is added, one-hot.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Box or gymnasium.spaces.Dict
        That of ``MagFold/TubeFeed-v0`` or of ``MagFold/TubeFeedGoal-v0``.
    backward : bool
        Whether component ``n`` leaves the tube first.

    Raises
    ------
    ValueError
        If the observation is another one.
    """

    _order: torch.Tensor

    def __init__(self, observation_space: Space[object], backward: bool = False) -> None:
        # The target's letters, one-hot, or the angles wanted of the joints.
        if isinstance(observation_space, spaces.Dict):
            n, width = int(np.prod(observation_space["desired_goal"].shape or 0)), 1
            size = int(np.prod(observation_space["observation"].shape or 0)) + n - 1
        else:
            size, width = int(np.prod(observation_space.shape or 0)), 3
            n = (size + 4) // 17
        self.width = width
        self._layout = ObservationLayout(n, side=1.0, words=())
        if size != self._layout.size + width * (n - 1):
            raise ValueError(
                f"observation_space: {observation_space} is not allowed; "
                "must be that of MagFold/TubeFeed-v0 or MagFold/TubeFeedGoal-v0"
            )
        order = _order(self._layout, width, backward)
        super().__init__(observation_space, features_dim=sum(order.shape))
        self.register_buffer("_order", torch.from_numpy(order), persistent=False)

    def forward(self, observations: torch.Tensor | Mapping[str, torch.Tensor]) -> torch.Tensor:
        """Return the features, (batch, features_dim), of a batch of observations."""
        entries = self.entries(observations)
        return self.ordered(entries, self.step(entries))

    def entries(self, observations: torch.Tensor | Mapping[str, torch.Tensor]) -> torch.Tensor:
        """Return what is wanted, `width` entries a joint, then the chain, (batch, entries)."""
        if isinstance(observations, torch.Tensor):
            return observations
        wanted = observations["desired_goal"][:, :-1]
        return torch.cat((wanted, observations["observation"]), dim=1)

    def step(self, entries: torch.Tensor) -> torch.Tensor:
        """Return how many components have left the tube, (batch,)."""
        chain = entries[:, entries.shape[1] - self._layout.size :]
        return chain[:, self._layout.slices["released"]].sum(dim=1).round().long()

    def ordered(self, entries: torch.Tensor, step: torch.Tensor) -> torch.Tensor:
        """Return the entries counted from the mouth, then the step, one-hot."""
        ordered = pad(entries, (0, 1)).gather(1, self._order[step])
        return torch.cat((ordered, one_hot(step, len(self._order))), dim=1)


def _order(layout: ObservationLayout, width: int, backward: bool) -> NDArray[np.int64]:
    """Return for each step, 0 to n, which entries to take, in order: (n + 1, entries).

    What is wanted comes first, `width` entries a joint, then the chain, of `layout`. What does not
    exist is numbered one beyond the last entry.
    """
    n = layout.n
    target = slice(0, width * (n - 1))
    missing = target.stop + layout.size

    def group(span: slice, width: int) -> NDArray[np.int64]:
        """Return the entries of a group, a row for each component or joint, in order of feed."""
        rows = np.arange(span.start, span.stop).reshape(-1, width)
        return rows[::-1] if backward else rows

    def pick(rows: NDArray[np.int64], places: NDArray[np.int64]) -> NDArray[np.int64]:
        exists = (places >= 0) & (places < len(rows))
        return np.where(exists[:, None], rows[places % len(rows)], missing).ravel()

    wanted = group(target, width)
    angles = target.stop + group(layout.slices["joint"], 1)
    components = [target.stop + group(layout.slices[name], each) for name, each in WIDTHS.items()]
    steps: list[NDArray[np.int64]] = []
    for step in range(n + 1):
        # The joint that folds next lies between the component that is out and the next one.
        ahead = np.arange(step - 1, step + n - 2)
        behind = np.arange(step - 2, step - n - 1, -1)
        out = np.arange(step - 1, step - n - 1, -1)
        known = [pick(wanted, ahead), pick(wanted, behind), pick(angles, behind)]
        steps.append(np.concatenate(known + [pick(rows, out) for rows in components]))
    return np.array(steps)
