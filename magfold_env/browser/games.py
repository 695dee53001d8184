"""The environments that can be played on a web page, and the networks of policies for them."""

import base64
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs import EARLIER
from magfold_env.envs.camera_track import FORCE_NOISE, FORCE_SCALE, INTERVAL, STEEPEST, TIME_COST
from magfold_env.envs.chains.dynamic import REFERENCE_SPEED
from magfold_env.envs.spaces.actions import FASTEST, PATTERNS, scaled_speeds
from magfold_env.envs.tasks.setup import FoldTask
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.unknown_floor import HORIZON, UnknownFloorEnv
from magfold_env.envs.wrappers.mouth_order import LETTERS, mouth_order
from magfold_env.files import configs_dir
from magfold_env.scene import Scene
from magfold_env.scene.magnets import Length
from magfold_env.scoring import policy_file
from magfold_env.scoring.policy_file import Discrete, MultiDiscrete

SPREADS = ("friction", "friction_decades", "remanence", "feed_speed", "feed_jitter", "magnet")
"""Spreads that the games can draw; all others must be 0."""

POLICIES = {"tube_feed": "ppo-tube-feed-0", "unknown_floor": "ppo-unknown-floor-0"}
"""The shipped policies that play the games."""

HIDDEN, LAST = "mlp_extractor.policy_net", "action_net"  # the actor's layers, by SB3's names


def games() -> dict[str, Any]:
    """Return each game's parameters and spreads, by the game's name."""
    return {"tube_feed": tube_feed(), "unknown_floor": unknown_floor()}


def tube_feed() -> dict[str, Any]:
    """Return the parameters and spreads of ``MagFold/TubeFeed-v0``."""
    task = FoldTask(None, TubeFeedEnv.default_scene, TubeFeedEnv.action_scope)
    levels: list[float] = task.actions.speeds.tolist()
    return _drawn(task.scene) | {
        "words": task.words,
        "baselines": [task.baseline_of(word).score for word in task.words],
        "patterns": PATTERNS,
        "speeds": levels,
        "scaled": [float(scaled_speeds(level)) for level in levels],
    }


def unknown_floor() -> dict[str, Any]:
    """Return the parameters and spreads of ``MagFold/UnknownFloor-v0``."""
    setup = UnknownFloorEnv.make_setup(actions="discrete", **EARLIER["MagFold/UnknownFloor-v0"])
    return _drawn(setup.scene) | {
        "tasks": [task.model_dump(mode="json") for task in setup.tasks],
        "speeds": setup.actions.speeds.tolist(),
        "fastest": FASTEST,
        "interval": INTERVAL,
        "steepest": STEEPEST,
        "horizon": HORIZON,
        "timeCost": TIME_COST,
        "forceNoise": FORCE_NOISE,
        "forceScale": FORCE_SCALE,
    }


def _drawn(scene: Scene) -> dict[str, Any]:
    """Return a game's scene in the form that the page's scripts expect, and its spreads."""
    spreads = {name: value for name, value in scene.spreads.model_dump().items() if value}
    assert set(spreads) <= set(SPREADS), spreads
    data = scene.model_dump(mode="json")
    feed = ("direction", "loading", "force_limit", "bore", "wall")
    return {
        "scene": {
            **{name: data[name] for name in ("mount", "friction", "duration")},
            "feed": {name: data["feed"][name] for name in feed},
            "casing": {name: data["casing"][name] for name in ("side", "corner_radius")},
            "magnets": {name: data["magnets"][name] for name in ("remanence", *get_args(Length))},
            "solver": {name: data["solver"][name] for name in ("tolerance", "max_steps")},
        },
        "n": scene.n,
        "spreads": dict.fromkeys(SPREADS, 0.0) | spreads,
        "offset": scene.start_offset_spread,
        "referenceSpeed": REFERENCE_SPEED,
    }


def networks() -> dict[str, Any]:
    """Return the networks of the games' policies, by the games' names."""
    return {name: network(policy) for name, policy in POLICIES.items()}


def network(name: str) -> dict[str, Any]:
    """Return a shipped policy in the form that the page's scripts expect.

    Weights lose their last eight bits, a relative change of at most 2⁻¹⁶. The first bytes of all
    weights are stored first, then the second bytes and the third ones, which compresses better.
    """
    path = configs_dir() / "policies" / f"{name}.safetensors"
    file = policy_file.read(path)
    settings = file.settings
    plain = settings.activation == "tanh" and settings.lstm is None and not settings.blind
    plain = plain and settings.view == "own"
    if not plain or settings.features == "symmetric":
        raise ValueError(f"{path}: must be tanh layers that see all of the last observations")
    shapes = {
        part: file.tensors[part]["shape"]
        for layer in [*(f"{HIDDEN}.{2 * k}" for k in range(len(settings.actor))), LAST]
        for part in (f"{layer}.weight", f"{layer}.bias")
    }
    weights, actions = file.weights(shapes).values(), settings.actions
    assert isinstance(actions, Discrete | MultiDiscrete)
    n = (settings.observations.size + 4) // 17  # number of components, if the policy plays TubeFeed
    order = mouth_order(n, LETTERS, settings.backward)
    return {
        "policy": name,
        "frames": settings.frames,
        "order": order.tolist() if settings.features == "mouth" else None,
        "choices": [actions.n] if isinstance(actions, Discrete) else list(actions.nvec),
        "inputs": file.tensors[f"{HIDDEN}.0.weight"]["shape"][1],
        "widths": [shape[0] for shape in shapes.values() if len(shape) == 2],
        "weights": base64.b64encode(
            shortened(np.concatenate([each.ravel() for each in weights]))
        ).decode(),
    }  # fmt: skip


def shortened(numbers: NDArray[np.float32]) -> bytes:
    """Round numbers to 24 bits; return the most significant byte of each, then the others."""
    bits = numbers.astype("<f4").view("<u4").astype(np.uint64)
    rounded = (bits + 0x7F + ((bits >> np.uint64(8)) & np.uint64(1))) >> np.uint64(8)
    return b"".join(
        ((rounded >> np.uint64(8 * k)) & np.uint64(0xFF)).astype("u1").tobytes() for k in (2, 1, 0)
    )
