"""Policies' networks as plain numbers, for a page to play with.

Weights lose their last eight bits, a relative 2⁻¹⁶; what is left is kept byte by byte, the
first of all weights, then the second and the third, which compresses better.
"""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.wrappers.mouth_order import LETTERS, mouth_order
from magfold_env.files import configs_dir
from magfold_env.scoring import policy_file
from magfold_env.scoring.policy_file import Discrete, MultiDiscrete, PolicySettings

POLICIES = {"tube_feed": "ppo-tube-feed-0", "unknown_floor": "ppo-unknown-floor-0"}
"""Those of the games, among the policies that are shipped."""

HIDDEN, LAST = "mlp_extractor.policy_net", "action_net"  # layers that act, by SB3's names


def networks() -> dict[str, Any]:
    """Return the networks that act in the games, by the games' names."""
    return {name: network(policy) for name, policy in POLICIES.items()}


def network(name: str) -> dict[str, Any]:
    """Return a shipped policy as a page's script takes it.

    Raises
    ------
    ValueError
        If a page could not play it.
    """
    path = configs_dir() / "policies" / f"{name}.safetensors"
    file = policy_file.read(path)
    settings = file.settings
    plain = settings.activation == "tanh" and settings.lstm is None and not settings.blind
    if not plain or settings.features == "symmetric":
        raise ValueError(f"{path}: must be tanh layers that see all of the last observations")
    shapes = {
        part: file.tensors[part]["shape"]
        for layer in [*(f"{HIDDEN}.{2 * k}" for k in range(len(settings.actor))), LAST]
        for part in (f"{layer}.weight", f"{layer}.bias")
    }
    weights = file.weights(shapes).values()
    return {
        "policy": name,
        "frames": settings.frames,
        "order": _order(settings) if settings.features == "mouth" else None,
        "choices": _choices(settings),
        "inputs": file.tensors[f"{HIDDEN}.0.weight"]["shape"][1],
        "widths": [shape[0] for shape in shapes.values() if len(shape) == 2],
        "weights": base64.b64encode(
            shortened(np.concatenate([each.ravel() for each in weights]))
        ).decode(),
    }  # fmt: skip


def _order(settings: PolicySettings) -> list[list[int]]:
    """Return in which order the network sees the observation of tube feed, step by step."""
    n = (settings.observations.size + 4) // 17
    return mouth_order(n, LETTERS, settings.backward).tolist()


def _choices(settings: PolicySettings) -> list[int]:
    """Return of how many each of the numbers is chosen that make an action."""
    if isinstance(settings.actions, Discrete):
        return [settings.actions.n]
    assert isinstance(settings.actions, MultiDiscrete)
    return list(settings.actions.nvec)


def shortened(numbers: NDArray[np.float32]) -> bytes:
    """Return numbers to the nearest of 24 bits, byte by byte, the most significant first."""
    bits = numbers.astype("<f4").view("<u4").astype(np.uint64)
    rounded = (bits + 0x7F + ((bits >> np.uint64(8)) & np.uint64(1))) >> np.uint64(8)
    return b"".join(
        ((rounded >> np.uint64(8 * k)) & np.uint64(0xFF)).astype("u1").tobytes() for k in (2, 1, 0)
    )
