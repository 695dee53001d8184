"""The folds of Figures 13 and 14: made by both solvers, and how far apart they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from magfold_env.paper import motions
from magfold_env.paper.motions import Motion
from magfold_env.paper.quoted import SNAP
from magfold_env.paper.reproduction import Measured
from magfold_env.reporting.tables import Progress, Row

BESIDE = 1
"""Frames within which a jump and a snap belong together."""

PAPER, OURS, DEVICE = "paper's solver", "our solver, points", "our solver, rectangles"
PAIRS = {
    "the solver": (PAPER, OURS),
    "the magnets": (OURS, DEVICE),
    "both": (PAPER, DEVICE),
}
"""What is compared, by what differs."""


class _Folds(NamedTuple):
    """The motions of one strength of magnets, by who made them."""

    charge: str
    motions: dict[str, Motion]

    def pair(self, differing: str) -> tuple[Motion, Motion]:
        one, other = PAIRS[differing]
        return self.motions[one], self.motions[other]


def measure(quick: bool, progress: Progress) -> Measured:
    """Follow the fold with both solvers and both kinds of magnets, for both strengths."""
    over_time: list[Row] = []
    folds: list[Row] = []
    differences: list[Row] = []
    charges = motions.charges()
    for k, (name, charge) in enumerate(charges.items()):
        progress(k / len(charges), name)
        scene = motions.default_steps(charge)
        ours = motions.exact(scene)
        found = _Folds(
            name,
            {
                PAPER: motions.follow(scene),
                OURS: motions.follow(ours),
                DEVICE: motions.follow(motions.rectangles(ours)),
            },
        )
        folds += [_fold_row(name, made_by, motion) for made_by, motion in found.motions.items()]
        differences += [_difference_row(found, differing) for differing in PAIRS]
        over_time += _frames(found)
    return {"over-time": over_time, "folds": folds, "differences": differences}


def _fold_row(name: str, made_by: str, motion: Motion) -> Row:
    snaps = motion.snaps()
    return {
        "charge": name,
        "made by": made_by,
        "word": motion.word,
        "ended": motion.ended,
        "at [s]": motion.end,
        "joints in the order in which they shut": " ".join(map(str, snaps)) or "none",
        "magnets set free [mJ]": 1e3 * motion.freed,
        "energy won [mJ]": 1e3 * motion.gained,
    }


def _difference_row(found: _Folds, differing: str) -> Row:
    one, other = found.pair(differing)
    apart = motions.displacement(one, other)
    turned = np.abs(one.joints - other.joints)
    early = motions.before_snap(one, other)
    jump = int(np.abs(np.diff(apart)).argmax())
    return {
        "charge": found.charge,
        "different": differing,
        "displacement [mm]": 1e3 * float(apart.mean()),
        "before the first snap [mm]": 1e3 * float(apart[early].mean()),
        "angle [rad]": float(turned.mean()),
        "before the first snap [rad]": float(turned[early].mean()),
        "largest jump [mm]": 1e3 * float(np.abs(np.diff(apart))[jump]),
        "jump at [s]": float(one.time[jump + 1]),
        "snap beside it": "yes" if _snap_near(one, jump) else "no",
    }


def _snap_near(motion: Motion, frame: int) -> bool:
    """Whether a joint snaps, or tears off, about between a frame and the next."""
    shut = np.abs(motion.joints) >= SNAP
    changed = (shut[1:] != shut[:-1]).any(axis=1)
    return bool(changed[max(frame - BESIDE, 0) : frame + BESIDE + 1].any())


def _frames(found: _Folds) -> list[Row]:
    rows: list[Row] = []
    apart = {differing: 1e3 * motions.displacement(*found.pair(differing)) for differing in PAIRS}
    for k, time in enumerate(found.motions[PAPER].time.tolist()):
        row: Row = {"charge": found.charge, "time [s]": time}
        for made_by, motion in found.motions.items():
            for j, angle in enumerate(np.rad2deg(motion.joints[k]).tolist(), start=1):
                row[f"{made_by}, joint {j} [°]"] = angle
        rows.append(row | {f"{key} [mm]": float(value[k]) for key, value in apart.items()})
    return rows
