"""The environments' benchmark: who plays what, what counts as Python's share, and the report."""

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

from magfold_bench import overhead
from magfold_bench.episodes import log_uniform, play_single, play_vector, single, vector
from magfold_bench.parts import BENCHMARKS
from magfold_env.cli import app
from magfold_env.engine.compile.jit import numba_config
from magfold_env.envs.spaces import observation
from magfold_env.envs.spaces.actions import ActionTable
from tests.benchmarks.command import measuring

OPTIONS = {"fidelity": "quasistatic", "actions": "box"}


class Diary(gymnasium.Wrapper):
    """Notes how every episode went."""

    def __init__(self, env):
        super().__init__(env)
        self.episodes = []

    def reset(self, **given):
        self.episodes.append([])
        return self.env.reset(**given)

    def step(self, action):
        result = self.env.step(action)
        self.episodes[-1].append(result[0])
        return result


def test_speeds_are_log_uniform_over_their_whole_range():
    actions = log_uniform(np.random.default_rng(0), 6, 500)
    table = ActionTable(9, kind="box")
    decoded = [table.decode(action) for action in actions.reshape(-1, 5)]
    speeds = np.log([speed for _, speed in decoded])
    low, high = np.log(table.speeds[[0, -1]])
    counts, _ = np.histogram(speeds, bins=6, range=(low, high))
    assert counts.sum() == 3000
    np.testing.assert_allclose(counts, 500, atol=100)
    assert len({faces for faces, _ in decoded}) == 16


def test_alone_and_side_by_side_the_same_episodes_are_played(monkeypatch):
    actions = log_uniform(np.random.default_rng(1), 6, 4)
    alone = Diary(single(**OPTIONS))
    play_single(alone, 7, actions)
    together = vector(4, fidelity="quasistatic", actions="box")
    seen, step = [], together.step

    def noted(given):
        seen.append(step(given)[0].copy())

    monkeypatch.setattr(together, "step", noted)
    play_vector(together, 7, actions)
    assert len(seen) == 6
    for k, episode in enumerate(alone.episodes):
        # The last observation of a vector is already the next episode's.
        for mine, theirs in zip(episode[:-1], seen, strict=False):
            np.testing.assert_array_equal(mine, theirs[k])


def test_the_line_through_times_is_found():
    rows = [{"envs": k, "time [µs]": 15.0 + 0.25 * k} for k in (1, 4, 16, 64, 256)]
    assert overhead.fit(rows) == pytest.approx((15.0, 0.25))


@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")
def test_the_kernel_clock_counts_calls_of_kernels_and_nothing_else():
    env = single(**OPTIONS)
    actions = log_uniform(np.random.default_rng(2), 6, 1)
    play_single(env, 0, actions)  # compiles
    names = {name: value for name, value in vars(observation).items() if callable(value)}
    clock = overhead.KernelClock()
    with clock.running():
        assert clock.inside == 0.0
        assert any(vars(observation)[name] is not names[name] for name in names)
        play_single(env, 0, actions)
    assert clock.inside > 0.0
    assert all(vars(observation)[name] is names[name] for name in names)
    inside = clock.inside
    play_single(env, 0, actions)
    assert clock.inside == inside


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    return measuring("env", tmp_path_factory)


@pytest.mark.medium
@pytest.mark.parametrize("name", [name for name, part in BENCHMARKS["env"].items() if part.draw])
def test_every_part_runs_and_draws(name, measured):
    part, files = measured(name)
    assert part["rows"]
    assert files == {"env.json", f"{name}.csv", f"{name}.png"}


def test_python_adds_less_than_the_whole_step_takes(measured):
    part, _ = measured("overhead")
    assert {row["measured on"] for row in part["rows"]} == {
        overhead.FIRST,
        overhead.ON_THE_WAY,
        overhead.LAST,
    }
    assert all(row["time [µs]"] > 0.0 for row in part["rows"])


def test_unknown_parts_are_told():
    wrong = CliRunner().invoke(app.app, ["bench", "env", "--only", "rest"])
    assert wrong.exit_code == 2
    assert f"must be one of {', '.join(BENCHMARKS['env'])}" in wrong.stderr
