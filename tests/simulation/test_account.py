"""Tests that a chain's work and losses, summed separately, add up to its energy."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws import mechanics
from magfold_bench.laws.random_scenes import designed_sequence
from magfold_env.fold import turns
from magfold_env.shapes import FloatArray
from magfold_env.simulation.session import Session

DIAGONAL = mf.Casing().diagonal
RATE = 20000.0  # frames a second [1/s]: friction is summed over them


def pushed_and_pulled(seed: int, times: int, **changes: Any) -> mf.Scene:
    """Return a scene in which a tube pushes a folding chain out and pulls it back repeatedly."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 7))
    legs = [[goal, 0.1] for _ in range(times) for goal in (n - 0.8, rng.uniform(0.0, 0.8) * n)]
    feed: Any = {"bore": rng.uniform(1.05, 1.4) * DIAGONAL, "schedule": {"advance": legs}}
    scene = mf.Scene(sequence=designed_sequence(rng, n), mount="tube", feed=feed)
    return scene.replace(**changes).draw(rng)


def rubbed_away(scene: mf.Scene, motion: mf.Trajectory) -> float:
    """Return the work of friction on a recorded motion [J], by Coulomb's law on the ellipsoid."""
    lever = scene.casing.diagonal * motion.rates
    turning = np.stack([-lever * np.sin(motion.angles), lever * np.cos(motion.angles)], axis=-1)
    velocity = motion.base_velocity[:, None] + np.cumsum(turning, axis=1) - turning / 2.0
    slide = np.hypot(np.hypot(*velocity.T).T, 0.3826 * scene.casing.side * motion.rates)
    out = turns(scene) < motion.released[:, None]
    power = (slide * out) @ (scene.frictions * 9.8 * scene.masses)
    return float(np.trapezoid(power, motion.time))


def total_of(session: Session) -> float:
    """Return the energy of a chain, including that of in-plane gravity [J]."""
    seen = session.angles[None], session.rates[None], session.base_velocity[None]
    kinetic = mechanics.kinetic_energy(session.scene, *seen)
    weight = mechanics.weight_energy(session.scene, seen[0], session.base[None])
    return session.potential() + float(kinetic[0] + weight[0])


def imbalance(scene: mf.Scene, pushes: Sequence[tuple[float, float]] = ()) -> tuple[float, Session]:
    """Return the unexplained energy, as a share of the converted energy.

    ``pushes`` are speeds [m/s] and times [s] of a feed by hand, before the chain settles.
    """
    session = Session(scene, RATE if scene.frictions.any() else None)
    before = total_of(session)
    for speed, seconds in pushes:
        session.push(speed, seconds)
    session.settle()
    account, rubbed = session.account, 0.0
    if scene.frictions.any():
        motion: Any = session.fold().trajectory
        rubbed = rubbed_away(scene, motion)
    gained = total_of(session) - before
    terms = (account.feed, account.loading, account.bumps, -account.impacts, -rubbed)
    assert account.impacts >= -1e-12
    turned_over = max(sum(map(abs, terms)) + abs(gained), 1e-9)
    return abs(gained - sum(terms)) / turned_over, session


@pytest.mark.parametrize("friction", [0.0, 0.35])
@pytest.mark.parametrize("loading", ["preloaded", "at_mouth"])
def test_push_and_pull_balance(loading: str, friction: float) -> None:
    scene = pushed_and_pulled(1, 2, friction=friction, feed={"loading": loading})
    left, session = imbalance(scene)
    assert left < 1e-3
    assert session.account.feed > 0.0
    assert (session.account.loading != 0.0) == (loading == "at_mouth")


def balance_of_pushes(seed: int) -> float:
    """Return the unexplained energy of a random chain that is pushed and pulled by hand."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 10))
    poles = tuple("".join(rng.choice(list("NS"), 4)) for _ in range(n))
    feed: Any = {
        "loading": rng.choice(["preloaded", "at_mouth"]),
        "direction": rng.choice(["forward", "backward"]),
        "bore": rng.uniform(1.05, 1.4) * DIAGONAL,
        "force_limit": (0.3, 1.0, 20.0, None)[rng.integers(4)],
    }
    scene = mf.Scene(
        sequence=poles if rng.random() < 0.5 else designed_sequence(rng, n), mount="tube",
        feed=feed, friction=rng.choice([0.0, 0.3, rng.uniform(0.01, 0.6)]),
        gravity=mf.Gravity(in_plane=tuple(rng.choice([0.0, 2.0]) * rng.uniform(-1.0, 1.0, 2))),
    )  # fmt: skip
    count = int(rng.integers(2, 12))
    pushes = list(zip(rng.uniform(-0.3, 0.5, count), rng.uniform(0.02, 0.3, count), strict=True))
    return imbalance(scene.draw(rng), pushes)[0]


def test_pushes_by_hand_balance() -> None:
    assert max(map(balance_of_pushes, range(30))) < 3e-4


@pytest.mark.parametrize("mount", ["free", "pinned", "tube"])
@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_bumped_chains_balance(mount: str, friction: float) -> None:
    scene = mf.load_scene("paper/sequence-3").replace(
        mount=mount, friction=friction, duration=0.3, feed={"speed": 0.3},
        gravity={"in_plane": (0.0, -0.5)}, bumps={"rate": 60.0, "speed": 0.3, "seed": 5},
    )  # fmt: skip
    left, session = imbalance(scene.draw(np.random.default_rng(0)))
    assert left < 1e-3
    assert session.account.bumps > 0.0


def impulses(motion: mf.Trajectory) -> FloatArray:
    """Return the impulse of the feed between successive frames [N·s]."""
    return motion.push * np.diff(motion.time, prepend=motion.time[0] - 1.0 / RATE)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_recorded_push_is_the_impulse(direction: str) -> None:
    scene = mf.load_scene("paper/sequence-3").replace(
        mount="tube", friction=0.3, feed={"direction": direction, "speed": 0.1}
    )
    session = Session(scene.draw(np.random.default_rng(0)), RATE)
    session.settle()
    fold = session.fold()
    motion: Any = fold.trajectory
    assert impulses(motion).sum() == pytest.approx(session.account.impulse, rel=1e-9)
    assert not motion.push[motion.released == session.n][1:].any()
    assert fold.push_peak == session.account.push_peak
