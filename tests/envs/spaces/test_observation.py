from itertools import pairwise

import numpy as np
import pytest

from magfold_env.envs.chains.progress import Progress
from magfold_env.envs.spaces.observation import ObservationLayout, squash
from magfold_env.simulation.chain_state import ChainState

SIDE = 0.0125


def random_state(rng: np.random.Generator, n: int, scale: float = 1.0) -> ChainState:
    return ChainState(
        angles=scale * rng.normal(size=n),
        rates=100 * scale * rng.normal(size=n),
        base=scale * rng.normal(size=2),
        base_velocity=scale * rng.normal(size=2),
    )


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
        progress = Progress.begin(6, "forward")
        progress.choose(0, "NSNS", 0.6)
        observation = layout.observe(
            random_state(rng, 6, scale), progress, layout.one_hot(["LRLLL"])
        )
        assert observation in layout.space


def test_entries_mean_what_the_table_says() -> None:
    layout = ObservationLayout(3, SIDE)
    state = ChainState(np.array([np.pi, np.pi / 2, np.pi]), np.zeros(3), np.zeros(2), np.zeros(2))
    progress = Progress.begin(3, "forward")
    progress.choose(0, "NSSN", 0.6)
    progress.choose(1, "SSSS", 0.01)
    progress.release(2)
    seen = layout.observe(state, progress, layout.one_hot(["RL"]))
    part = {name: seen[group].tolist() for name, group in layout.slices.items()}
    assert part["target"] == [0, 0, 1, 1, 0, 0]
    assert part["released"] == [1, 1, 0]
    assert part["magnets"] == [1, -1, -1, 1, -1, -1, -1, -1, 0, 0, 0, 0]
    assert part["speed"] == pytest.approx([1, -1, 0])
    assert part["joint"] == pytest.approx([-0.5, 0.5])
    assert part["heading"] == pytest.approx([0, -1, 1, 0, 0, -1], abs=1e-7)


def test_positions_and_velocities_are_those_of_the_centres() -> None:
    layout = ObservationLayout(6, SIDE)
    state = random_state(np.random.default_rng(2), 6)
    seen = layout.observe(state, Progress.begin(6, "backward"), layout.one_hot(["LRLLL"]))
    length = 6 * np.sqrt(2.0) * SIDE
    for name, values in (
        ("position", state.centres(SIDE) / length),
        ("velocity", state.velocities(SIDE)),
        ("rate", state.rates / 100),
    ):
        expected = values / (1 + np.abs(values))
        np.testing.assert_allclose(seen[layout.slices[name]], expected.ravel(), atol=1e-6)


def test_words_and_extra_groups_go_around_the_chain() -> None:
    layout = ObservationLayout(3, SIDE, words=("target", "avoid"), extra=(("feed", 2),))
    names = list(layout.slices)
    assert names[:2] == ["target", "avoid"]
    assert names[-1] == "feed"
    state = random_state(np.random.default_rng(3), 3)
    words = layout.one_hot(["LR", "SL"])
    seen = layout.observe(state, Progress.begin(3, "forward"), words, (0.25, -0.5))
    assert seen[layout.slices["target"]].tolist() == [1, 0, 0, 0, 0, 1]
    assert seen[layout.slices["avoid"]].tolist() == [0, 1, 0, 1, 0, 0]
    assert seen[-2:].tolist() == [0.25, -0.5]


def test_squashing_keeps_order_and_can_be_undone() -> None:
    values = np.linspace(-1e3, 1e3, 101)
    squashed = np.array([squash(value) for value in values])
    assert np.all(np.diff(squashed) > 0)
    assert np.all(np.abs(squashed) < 1)
    np.testing.assert_allclose(squashed / (1 - np.abs(squashed)), values)
