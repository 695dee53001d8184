"""What a page needs to know of the environments that can be played in it."""

from typing import Any

from magfold_env.envs.camera_track import FORCE_NOISE, FORCE_SCALE, INTERVAL, STEEPEST, TIME_COST
from magfold_env.envs.chains.dynamic import REFERENCE_SPEED
from magfold_env.envs.spaces.actions import FASTEST, PATTERNS, scaled_speeds
from magfold_env.envs.tasks.world import FoldTask
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.unknown_floor import HORIZON, UnknownFloorEnv
from magfold_env.scene import Scene

SPREADS = ("friction", "friction_decades", "remanence", "feed_speed", "feed_jitter", "magnet")
"""What games can draw; the others must be nought."""


def games() -> dict[str, Any]:
    """Return the rules' numbers of each, by name, and what is drawn in them."""
    return {"tube_feed": tube_feed(), "unknown_floor": unknown_floor()}


def tube_feed() -> dict[str, Any]:
    """Return those of ``MagFold/TubeFeed-v0``."""
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
    """Return those of ``MagFold/UnknownFloor-v0``."""
    world = UnknownFloorEnv.make_world(actions="discrete")
    return _drawn(world.scene) | {
        "tasks": [task.model_dump(mode="json") for task in world.tasks],
        "speeds": world.actions.speeds.tolist(),
        "fastest": FASTEST,
        "interval": INTERVAL,
        "steepest": STEEPEST,
        "horizon": HORIZON,
        "timeCost": TIME_COST,
        "forceNoise": FORCE_NOISE,
        "forceScale": FORCE_SCALE,
    }


def _drawn(scene: Scene) -> dict[str, Any]:
    """Return the scene of a game as a page's script takes it, and what is drawn of it."""
    spreads = {name: value for name, value in scene.spreads.model_dump().items() if value}
    assert set(spreads) <= set(SPREADS), spreads
    data = scene.model_dump(mode="json")
    feed = ("direction", "loading", "force_limit", "bore", "wall")
    return {
        "scene": {
            **{name: data[name] for name in ("mount", "friction", "duration")},
            "feed": {name: data["feed"][name] for name in feed},
            "magnets": {"remanence": data["magnets"]["remanence"]},
            "solver": {name: data["solver"][name] for name in ("tolerance", "max_steps")},
        },
        "n": scene.n,
        "spreads": dict.fromkeys(SPREADS, 0.0) | spreads,
        "offset": scene.start_offset_spread,
        "referenceSpeed": REFERENCE_SPEED,
    }
