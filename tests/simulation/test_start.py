"""Where a chain is at first."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.overlap import beyond_bore
from magfold_env.envs.chains.draws import DrawnChains
from magfold_env.simulation.session import Session
from magfold_env.simulation.start import hinge_offsets

SEQUENCE = ("NSNN", "NSSN", "SNSS", "SSNN")


def tube(**changes: Any) -> mf.Scene:
    """A chain in a tube."""
    return mf.Scene(sequence=SEQUENCE).replace(mount="tube", **changes)


def hinges(session: Session) -> np.ndarray:
    """Distances of the hinges from the axis [m], component 1's outer one first."""
    rises = session.scene.casing.diagonal * np.sin(session.angles)
    return session.base[1] + np.concatenate([[0.0], np.cumsum(rises)])


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_hinges_are_where_the_scene_puts_them(direction: str) -> None:
    offsets = (1e-4, -2e-4, 4e-4, 0.0, -3e-4)
    scene = tube(start_offsets=offsets, feed={"direction": direction})
    session = Session(scene)
    np.testing.assert_allclose(hinges(session), offsets, atol=1e-16)
    heading = np.pi if direction == "forward" else 0.0
    assert np.abs(session.angles - heading).max() < 0.04


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_given_angles_are_kept_and_lie_along_the_axis(direction: str) -> None:
    joints = (0.03, -0.02, 0.01)
    scene = tube(start_angles=joints, feed={"direction": direction})
    session = Session(scene)
    np.testing.assert_allclose(np.diff(session.angles), joints, atol=1e-12)
    across = hinges(session)
    np.testing.assert_allclose(across, hinge_offsets(scene), atol=1e-17)
    assert across.max() == pytest.approx(-across.min())
    assert across.max() < scene.play


def test_a_wider_bore_holds_the_chain_less_straight() -> None:
    tight, wide = (
        tube(start_angle_spread=0.4, feed={"bore": bore * mf.Casing().diagonal})
        for bore in (1.01, 1.5)
    )
    for scene, most in ((tight, tight.play), (wide, 0.1 * wide.casing.diagonal)):
        drawn = [scene.draw(np.random.default_rng(seed)) for seed in range(200)]
        offsets = np.abs([hinge_offsets(each) for each in drawn])
        assert 0.95 * most < offsets.max() <= most
        joints = np.abs([np.diff(Session(each).angles) for each in drawn[:20]])
        assert joints.max() <= 4.1 * most / scene.casing.diagonal
    assert mf.simulate(tight, seed=1).time != mf.simulate(wide, seed=1).time


@pytest.mark.slow
def test_nothing_is_held_beyond_the_inner_wall_in_100_000_releases() -> None:
    rng = np.random.default_rng(0)
    many = 1000
    for _ in range(100):
        n, direction = int(rng.integers(1, 13)), str(rng.choice(["forward", "backward"]))
        bore = rng.uniform(1.001, 2.0) * mf.Casing().diagonal
        scene = tube(
            sequence=("NSNS",) * n,
            feed={"direction": direction, "bore": bore},
            start_angle_spread=rng.uniform(0.0, 0.5),
        )
        drawn = DrawnChains([scene], many)
        drawn.draw(
            np.arange(many), [np.random.default_rng(rng.integers(2**32)) for _ in range(many)]
        )
        view = Session(scene.draw(rng))._view
        held = np.full(many, n)
        base = view.outer_hinge(drawn.chains.q, held)
        angles = view.headings(drawn.chains.q[:, :n])
        far = beyond_bore(scene, angles, base, np.zeros(many, dtype=np.int64))
        assert far.max() <= 1e-12
