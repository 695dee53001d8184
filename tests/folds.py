"""Recorded folds that cost no simulation."""

from __future__ import annotations

import numpy as np

import magfold_env as mf
from magfold_env.shapes import headings, word_to_angles
from magfold_env.simulation.frames import magnetic_energy

FREE = mf.load_scene("paper/sequence-3")


def recorded(word: str, scene: mf.Scene = FREE, frames: int = 30, time: float = 0.5) -> mf.Fold:
    """Return a fold in which all joints turn evenly."""
    share = np.linspace(0.0, 1.0, frames)
    angles = np.array([headings(word_to_angles(word) * s, first=0.4 * s) for s in share])
    rates = np.gradient(angles, share * time, axis=0)
    base = np.stack([0.02 * share, -0.01 * share], axis=1)
    released = np.full(frames, scene.n)
    if scene.mount == "tube":
        released = np.ceil(share * scene.n).astype(np.int64)
    return mf.Fold(
        scene=scene,
        status=mf.FoldStatus.FOLDED,
        message=f"folded at t = {time:.4g} s",
        word=word,
        angles=angles[-1],
        base=base[-1],
        energy=-1e-2,
        time=time,
        steps=1,
        evaluations=1,
        trajectory=mf.Trajectory(
            share * time,
            angles,
            base,
            rates,
            released,
            base_velocity=np.gradient(base, share * time, axis=0),
            push=0.1 * share,
        ),
        magnetic_energy=magnetic_energy,
    )
