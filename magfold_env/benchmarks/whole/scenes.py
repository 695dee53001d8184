"""Ten scenes with a name, from the shipped ones: what a user folds, in every mount there is."""

from __future__ import annotations

import numpy as np

from magfold_env.scene import Magnets, Scene, Solver, load_scene

LONGEST = 1.0  # [s] simulated after the last release; most folds rest before that
SWING = 0.3  # [s] of the pendulum, seven times √(d/g): longer swings are chaotic
SPREAD = 0.03  # [rad] of the start angles
LONG = 12  # components of the longest chain
PENDULUM = "pendulum of three"


def named_scenes() -> dict[str, Scene]:
    """Return the scenes, their start angles yet to be drawn, with the solver's own settings."""
    one, two, three = (load_scene(f"paper/sequence-{k}") for k in (1, 2, 3))
    scenes = {
        "sequence 1, free": one,
        "sequence 2, frictionless": two.replace(friction=0.0),
        "sequence 3, free": three,
        "sequence 3, fed backward": three.replace(mount="tube", feed={"direction": "backward"}),
        "tube-feed": load_scene("tube-feed"),
        "anchor": load_scene("anchor"),
        f"{LONG} components": one.replace(
            sequence=one.sequence * (LONG // one.n),
            mount="tube",
            feed={"speed": 0.2},
            friction=0.1,
        ),
        "sequence 3, pinned": three.replace(mount="pinned"),
        "sequence 3, literal": load_scene("paper/sequence-3-literal"),
        PENDULUM: load_scene("pendulum-3"),
    }
    plain = {name: _plain(scene) for name, scene in scenes.items()}
    plain[PENDULUM] = plain[PENDULUM].replace(duration=SWING)
    return plain


def _plain(scene: Scene) -> Scene:
    """Return a scene with the default solver and accuracy of the magnets."""
    scene = scene.replace(duration=LONGEST, solver=Solver(), start_angle_spread=SPREAD)
    if scene.magnets is not None and scene.magnets.model == "strips":
        scene = scene.replace(magnets={"accuracy": Magnets().accuracy})
    return scene


def drawn(scene: Scene, seed: int) -> Scene:
    """Return a scene with the start angles of a seed."""
    return scene.draw(np.random.default_rng(seed))
