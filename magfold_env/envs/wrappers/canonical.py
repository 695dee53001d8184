"""A view of given chains that is the same for all images of a chain.

Physics does not distinguish a chain from one with swapped poles, its mirror image, or the same
chain counted from its other end (`magfold_env.envs.tasks.symmetry`). Of these eight images, the
*canonical view* shows the one that is fed forward, whose first joint must turn left, and whose
first face is N. Speeds mean the same for all images, so a policy that sees only this view plays all
of them alike.

In this view, the heading of a component is relative to its target: it is how far the joint towards
the tube deviates from its target angle. An unseen component beyond that joint counts as parallel to
the tube. The component that leaves the tube last shows its own heading.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.tasks.checks import require
from magfold_env.envs.tasks.symmetry import refuse_uneven
from magfold_env.scene import Scene

GROUPS = {"target", "magnets", "direction", "seen", "heading", "position"}
"""Groups of entries that the view changes; all others stay."""

Singles = NDArray[np.float32]


class CanonicalView:
    """Brings one or many observations of an environment with given chains into the canonical view.

    The layout of the observations does not change.

    Raises
    ------
    ValueError
        If the layout is of an environment in which chains are not given or contains the hidden
        draws, or if the scene distinguishes the images of a chain.
    """

    def __init__(self, layout: Layout, scene: Scene) -> None:
        if not layout.slices.keys() >= GROUPS or "tray" in layout.slices:
            raise ValueError(
                f"env: observations of {', '.join(layout.slices)} are not allowed in the canonical "
                "view; must be those of an environment with given chains, such as UnknownFloor"
            )
        allowed = "must be None in the canonical view, which does not permute drawn strengths"
        require("physics" not in layout.slices, "reveal", "physics", allowed)
        refuse_uneven(scene)
        self._slices, self._n = layout.slices, layout.n

    def __call__(self, entries: Singles) -> Singles:
        """Return the observations, (…, entries), in the canonical view."""
        out = np.array(entries).reshape(-1, entries.shape[-1])
        group = {name: self._group(out, name) for name in GROUPS}
        target, magnets, heading = group["target"], group["magnets"], group["heading"]
        seen, position = group["seen"], group["position"]
        backward = group["direction"][:, 0, 0] < 0.0
        target[backward] = target[backward, ::-1, ::-1]
        magnets[backward] = magnets[backward][:, ::-1, (2, 3, 0, 1)]
        heading[backward] = -heading[backward, ::-1]
        for each in (seen, position):
            each[backward] = each[backward, ::-1]
        group["direction"][:] = 1.0
        right = target[:, 0, 2] > target[:, 0, 0]  # the letters are L, S, R
        target[right] = target[right, :, ::-1]
        magnets[right] = magnets[right, :, ::-1]
        heading[right, :, 0] *= -1.0
        position[right, :, 1] *= -1.0
        magnets[magnets[:, 0, 0] < 0.0] *= -1.0
        heading[:, :-1] = _deviations(target, seen[..., 0], heading)
        return out.reshape(entries.shape)

    def _group(self, entries: Singles, name: str) -> Singles:
        """Return the entries of a group, (observations, joints or components, entries each)."""
        places = {"target": self._n - 1, "direction": 1}.get(name, self._n)
        return entries[:, self._slices[name]].reshape(len(entries), places, -1)


def _deviations(target: Singles, seen: Singles, heading: Singles) -> Singles:
    """Return sine and cosine of joints' deviations from their target angles, (…, n − 1, 2).

    They are 0 at joints whose component nearer to the tip is not seen.
    """
    sin, cos = heading[:, :-1, 0], heading[:, :-1, 1]
    out = seen[:, 1:] > 0.0
    # The chain leaves the tube backwards, so headings in the tube are π.
    next_sin = np.where(out, heading[:, 1:, 0], 0.0)
    next_cos = np.where(out, heading[:, 1:, 1], -1.0)
    turn_sin, turn_cos = next_sin * cos - next_cos * sin, next_cos * cos + next_sin * sin
    left, straight = target[..., 0] - target[..., 2], target[..., 1]
    off = (straight * turn_sin - left * turn_cos, straight * turn_cos + left * turn_sin)
    return np.clip(np.stack(off, axis=-1), -1.0, 1.0).astype(np.float32)


class CanonicalObservation(gymnasium.ObservationWrapper[Any, Any, Any], RecordConstructorArgs):
    """Shows observations in the canonical view; see `magfold_env.envs.wrappers.canonical`.

    The vector form is `magfold_env.envs.wrappers.vector.CanonicalObservation`.

    Parameters
    ----------
    env : gymnasium.Env
        An environment with given chains: UnknownFloor, Reprogram or Lumen.

    Raises
    ------
    ValueError
        If the environment is another one or reveals the hidden draws, or if its scene distinguishes
        the images of a chain.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        self._view = CanonicalView(env.get_wrapper_attr("layout"), env.get_wrapper_attr("scene"))

    def observation(self, observation: Singles) -> Singles:
        """Return the observation in the canonical view."""
        return self._view(observation)
