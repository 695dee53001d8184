"""Folds that need no simulation, with and without a trajectory."""

from __future__ import annotations

from typing import Any

import numpy as np

import magfold_env as mf
from magfold_env.shapes import headings, word_to_angles
from magfold_env.simulation.frames import magnetic_energy

FREE = mf.load_scene("paper/sequence-3")


def lying(scene: mf.Scene, word: str, first: float = 0.0, **changes: Any) -> mf.Fold:
    """Return a fold in the shape of a word, like a simulated one."""
    whole: dict[str, Any] = {
        "scene": scene, "status": mf.FoldStatus.FOLDED, "message": "folded at t = 0.5 s",
        "word": word, "angles": headings(word_to_angles(word), first=first), "base": np.zeros(2),
        "energy": -1e-3, "time": 0.5, "steps": 1, "evaluations": 1,
    }  # fmt: skip
    return mf.Fold(**whole | changes)


def recorded(word: str, scene: mf.Scene = FREE, frames: int = 30, time: float = 0.5) -> mf.Fold:
    """Return a recorded fold in which all joints turn at constant rates."""
    share = np.linspace(0.0, 1.0, frames)
    angles = np.array([headings(word_to_angles(word) * s, first=0.4 * s) for s in share])
    rates = np.gradient(angles, share * time, axis=0)
    base = np.stack([0.02 * share, -0.01 * share], axis=1)
    released = np.full(frames, scene.n)
    if scene.mount == "tube":
        released = np.ceil(share * scene.n).astype(np.int64)
    velocity = np.gradient(base, share * time, axis=0)
    motion = mf.Trajectory(
        share * time, angles, base, rates, released, velocity, 0.1 * share, scene.casing.side
    )
    ends = {"message": f"folded at t = {time:.4g} s", "time": time, "energy": -1e-2}
    moved = {"base": base[-1], "trajectory": motion, "magnetic_energy": magnetic_energy}
    return lying(scene, word, 0.4, **ends, **moved)
