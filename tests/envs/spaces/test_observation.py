from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from magfold_env.envs.chains.arrays import ChainArrays
from magfold_env.envs.spaces.actions import scaled_speeds, signs_of
from magfold_env.envs.spaces.observation import (
    Layout,
    camera_layout,
    chain_layout,
    fill,
    squash,
    take_frames,
)
from magfold_env.envs.tasks.goals import Goals
from magfold_env.simulation.view import ChainState

SIDE = 0.0125


def random_state(rng: np.random.Generator, n: int, scale: float = 1.0) -> ChainState:
    return ChainState(
        angles=scale * rng.normal(size=n), rates=100 * scale * rng.normal(size=n),
        base=scale * rng.normal(size=2), base_velocity=scale * rng.normal(size=2),
    )  # fmt: skip


def seen(layout: Layout, state: ChainState, arrays: ChainArrays, *words: str) -> np.ndarray:
    """Return the observation of a chain in a state."""
    for name, values in vars(state).items():
        getattr(arrays, name)[0] = values
    hots = []
    for word in words:
        goals = Goals([word], "word", 1)
        goals.want(np.array([0]), np.array([0]))
        hots.append(goals.one_hot)
    out = np.full((1, layout.size), np.nan, dtype=np.float32)
    fill(SIDE, arrays, np.concatenate(hots, axis=1), out)
    return out[0]


def choose(arrays: ChainArrays, index: int, faces: str, speed: float) -> None:
    arrays.signs[0, index], arrays.speeds[0, index] = signs_of(faces), scaled_speeds(speed)


def test_the_groups_fill_the_observation_without_gaps() -> None:
    for n in (2, 6, 11):
        layout = chain_layout(n, SIDE)
        edges = [(group.start, group.stop) for group in layout.slices.values()]
        assert edges[0][0] == 0
        assert all(stop == start for (_, stop), (start, _) in pairwise(edges))
        assert layout.space.shape == (edges[-1][1],) == (17 * n - 4,)


def test_velocities_are_the_derivatives_of_the_centres() -> None:
    state = random_state(np.random.default_rng(0), 6)
    step = 1e-7

    def moved(sign: int) -> np.ndarray:
        return ChainState(
            state.angles + sign * step * state.rates, state.rates,
            state.base + sign * step * state.base_velocity, state.base_velocity,
        ).centres(SIDE)  # fmt: skip

    numeric = (moved(1) - moved(-1)) / (2 * step)
    np.testing.assert_allclose(state.velocities(SIDE), numeric, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("scale", [0.0, 1.0, 1e6])
def test_any_finite_state_lies_in_the_space_as_squashed(scale: float) -> None:
    layout, length = chain_layout(6, SIDE), 6 * np.sqrt(2.0) * SIDE
    rng = np.random.default_rng(1)
    for _ in range(50):
        arrays, state = ChainArrays.empty(1, 6), random_state(rng, 6, scale)
        choose(arrays, 0, "NSNS", 0.6)
        observation = seen(layout, state, arrays, "LRLLL")
        assert observation in layout.space
        for name, values in (
            ("position", state.centres(SIDE) / length),
            ("velocity", state.velocities(SIDE)),
            ("rate", state.rates / 100),
        ):
            expected = values / (1 + np.abs(values))
            np.testing.assert_allclose(
                observation[layout.slices[name]], expected.ravel(), atol=1e-6
            )


def test_entries_mean_what_the_table_says() -> None:
    layout = chain_layout(3, SIDE)
    state = ChainState(np.array([np.pi, np.pi / 2, np.pi]), np.zeros(3), np.zeros(2), np.zeros(2))
    arrays = ChainArrays.empty(1, 3)
    choose(arrays, 0, "NSSN", 0.6)
    choose(arrays, 1, "SSSS", 0.01)
    arrays.released[0, :2] = True
    observation = seen(layout, state, arrays, "RL")
    part = {name: observation[group].tolist() for name, group in layout.slices.items()}
    assert part["target"] == [0, 0, 1, 1, 0, 0]
    assert part["released"] == [1, 1, 0]
    assert part["magnets"] == [1, -1, -1, 1, -1, -1, -1, -1, 0, 0, 0, 0]
    assert part["speed"] == pytest.approx([1, -1, 0])
    assert part["joint"] == pytest.approx([-0.5, 0.5])
    assert part["heading"] == pytest.approx([0, -1, 1, 0, 0, -1], abs=1e-7)


def framed(layout: Layout, state: ChainState, arrays: ChainArrays, noise: Any) -> dict:
    """Return the groups of a frame of a chain in a state."""
    for name, values in vars(state).items():
        getattr(arrays, name)[0] = values
    frames = np.full((1, 5 * layout.n), np.nan)
    take_frames(SIDE, np.array([0]), arrays, np.asarray(noise)[None], frames)
    first = layout.frame.start
    return {
        name: frames[0, layout.slices[name].start - first : layout.slices[name].stop - first]
        for name in layout.sizes
    }


def test_a_camera_sees_what_is_free_and_outside_and_no_motion() -> None:
    layout, arrays = camera_layout(4, SIDE, {}, {}), ChainArrays.empty(1, 4)
    pitch = np.sqrt(2.0) * SIDE
    # Fed backward: component 4 leads, component 1 is held, 2 was drawn in again and is free.
    state = ChainState(
        np.array([0.0, 0.1, 0.5, -0.5]), np.ones(4), np.array([-2.2 * pitch, 0.0]), np.ones(2)
    )
    arrays.forward[0] = False
    arrays.released[0, 1:] = True
    noise = np.random.default_rng(0).normal(size=12)
    seen = framed(layout, state, arrays, noise)
    assert seen["seen"].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert not seen["heading"][:4].any()
    assert not seen["position"][:4].any()
    headings = state.angles + np.radians(1.0) * noise[::3]
    sines = np.stack([np.sin(headings), np.cos(headings)], axis=1)
    np.testing.assert_allclose(seen["heading"][4:], sines[2:].ravel())
    centres = state.centres(SIDE) + 3e-4 * noise.reshape(4, 3)[:, 1:]
    shown = centres / (4 * pitch) / (1.0 + np.abs(centres / (4 * pitch)))
    np.testing.assert_allclose(seen["position"][4:], shown[2:].ravel())
    layout = camera_layout(3, SIDE, {}, {})
    rng, noise = np.random.default_rng(1), np.zeros(9)
    still = ChainState(rng.normal(size=3), np.zeros(3), np.array([0.1, 0.0]), np.zeros(2))
    moving = replace(still, rates=rng.normal(size=3), base_velocity=rng.normal(size=2))
    arrays = ChainArrays.empty(1, 3)
    arrays.released[:] = True
    one, other = (framed(layout, state, arrays, noise) for state in (still, moving))
    np.testing.assert_equal(one, other)


def test_squashing_keeps_order_and_can_be_undone() -> None:
    values = np.linspace(-1e3, 1e3, 101)
    squashed = np.array([squash(value) for value in values])
    assert np.all(np.diff(squashed) > 0)
    assert np.all(np.abs(squashed) < 1)
    np.testing.assert_allclose(squashed / (1 - np.abs(squashed)), values)
