"""A wrapper that adds noise to the measured entries of observations."""

from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.tasks.checks import require


class SensorNoise(gymnasium.ObservationWrapper[Any, Any, Any], RecordConstructorArgs):
    """Add noise to the measured entries of the observation; see `Layout.measured`.

    Entries that the agent knows (target, magnets, speeds, which components are out) do not change.
    Neither do the goals of ``MagFold/TubeFeedGoal-v0``, from which rewards are computed. The noise
    is drawn from the environment's own random numbers after everything else. A seed therefore gives
    the same physics in the first episode as without noise, and always the same sequence of
    episodes.

    Parameters
    ----------
    env : gymnasium.Env
        One of the environments of this package.
    spread : float
        Standard deviation in the units of the entries, which range from −1 to 1.

    Raises
    ------
    ValueError
        If `spread` is negative.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], spread: float) -> None:
        RecordConstructorArgs.__init__(self, spread=spread)
        super().__init__(env)
        require(spread >= 0.0, "spread", spread, "must be 0 or more")
        self._spread = spread
        layout = cast("Layout", env.get_wrapper_attr("layout"))
        self._measured = np.zeros(layout.size, dtype=np.bool_)
        for name in layout.measured:
            self._measured[layout.slices[name]] = True

    def observation(self, observation: Any) -> Any:
        """Return the observation with noise."""
        if isinstance(observation, dict):
            seen = cast("dict[str, NDArray[np.float32]]", observation)
            return {**seen, "observation": self._blurred(seen["observation"])}
        return self._blurred(observation)

    def _blurred(self, entries: NDArray[np.float32]) -> NDArray[np.float32]:
        noise = self._spread * self.np_random.standard_normal(int(self._measured.sum()))
        blurred = entries.copy()
        blurred[self._measured] = np.clip(blurred[self._measured] + noise, -1.0, 1.0)
        return blurred
