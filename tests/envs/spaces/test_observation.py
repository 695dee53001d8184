from itertools import pairwise

import numpy as np
import pytest

from magfold_env.envs.chains.arrays import ChainArrays
from magfold_env.envs.spaces.actions import scaled_speed, signs_of
from magfold_env.envs.spaces.observation import ObservationLayout, squash
from magfold_env.envs.tasks.goals import Goals
from magfold_env.simulation.view import ChainState

SIDE = 0.0125


def random_state(rng: np.random.Generator, n: int, scale: float = 1.0) -> ChainState:
    return ChainState(
        angles=scale * rng.normal(size=n),
        rates=100 * scale * rng.normal(size=n),
        base=scale * rng.normal(size=2),
        base_velocity=scale * rng.normal(size=2),
    )


def seen(
    layout: ObservationLayout, state: ChainState, arrays: ChainArrays, *words: str
) -> np.ndarray:
    """Return the observation of a chain in a state, with no extra group."""
    for name, values in vars(state).items():
        getattr(arrays, name)[0] = values
    hots = []
    for word in words:
        goals = Goals([word], "word", 1)
        goals.want(np.array([0]), np.array([0]))
        hots.append(goals.one_hot)
    out = np.full((1, layout.size), np.nan, dtype=np.float32)
    layout.fill(arrays, np.concatenate(hots, axis=1), out)
    return out[0]


def choose(arrays: ChainArrays, index: int, faces: str, speed: float) -> None:
    arrays.signs[0, index], arrays.speeds[0, index] = signs_of(faces), scaled_speed(speed)


def test_the_groups_fill_the_observation_without_gaps() -> None:
    for n in (2, 6, 11):
        layout = ObservationLayout(n, SIDE)
        edges = [(group.start, group.stop) for group in layout.slices.values()]
        assert edges[0][0] == 0
        assert all(stop == start for (_, stop), (start, _) in pairwise(edges))
        assert layout.space.shape == (edges[-1][1],) == (17 * n - 4,)


def test_velocities_are_the_derivatives_of_the_centres() -> None:
    state = random_state(np.random.default_rng(0), 6)
    step = 1e-7

    def moved(sign: int) -> np.ndarray:
        return ChainState(
            state.angles + sign * step * state.rates,
            state.rates,
            state.base + sign * step * state.base_velocity,
            state.base_velocity,
        ).centres(SIDE)

    numeric = (moved(1) - moved(-1)) / (2 * step)
    np.testing.assert_allclose(state.velocities(SIDE), numeric, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("scale", [0.0, 1.0, 1e6])
def test_any_finite_state_lies_in_the_space(scale: float) -> None:
    layout = ObservationLayout(6, SIDE)
    rng = np.random.default_rng(1)
    for _ in range(50):
        arrays = ChainArrays.empty(1, 6)
        choose(arrays, 0, "NSNS", 0.6)
        observation = seen(layout, random_state(rng, 6, scale), arrays, "LRLLL")
        assert observation in layout.space


def test_entries_mean_what_the_table_says() -> None:
    layout = ObservationLayout(3, SIDE)
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


def test_positions_and_velocities_are_those_of_the_centres() -> None:
    layout = ObservationLayout(6, SIDE)
    state = random_state(np.random.default_rng(2), 6)
    observation = seen(layout, state, ChainArrays.empty(1, 6), "LRLLL")
    length = 6 * np.sqrt(2.0) * SIDE
    for name, values in (
        ("position", state.centres(SIDE) / length),
        ("velocity", state.velocities(SIDE)),
        ("rate", state.rates / 100),
    ):
        expected = values / (1 + np.abs(values))
        np.testing.assert_allclose(observation[layout.slices[name]], expected.ravel(), atol=1e-6)


def test_words_and_extra_groups_go_around_the_chain() -> None:
    layout = ObservationLayout(3, SIDE, words=("target", "avoid"), extra=(("feed", 2),))
    names = list(layout.slices)
    assert names[:2] == ["target", "avoid"]
    assert names[-1] == "feed"
    state = random_state(np.random.default_rng(3), 3)
    observation = seen(layout, state, ChainArrays.empty(1, 3), "LR", "SL")
    assert observation[layout.slices["target"]].tolist() == [1, 0, 0, 0, 0, 1]
    assert observation[layout.slices["avoid"]].tolist() == [0, 1, 0, 1, 0, 0]
    assert np.isfinite(observation[:-2]).all()
    assert np.isnan(observation[-2:]).all()


def test_squashing_keeps_order_and_can_be_undone() -> None:
    values = np.linspace(-1e3, 1e3, 101)
    squashed = np.array([squash(value) for value in values])
    assert np.all(np.diff(squashed) > 0)
    assert np.all(np.abs(squashed) < 1)
    np.testing.assert_allclose(squashed / (1 - np.abs(squashed)), values)
