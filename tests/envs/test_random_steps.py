"""Tests that random actions never leave the spaces, break down or fill the memory."""

import gc
import mmap
import tracemalloc
from itertools import pairwise, product
from pathlib import Path
from typing import get_args

import gymnasium
import pytest

from magfold_env.envs import ENTRY_POINTS
from magfold_env.envs.spaces.actions import ActionKind
from magfold_env.scoring.track import TRACKS
from tests.envs.vectors import kinds_of

WORLDS = [
    setup
    for setup in product(ENTRY_POINTS, ("dynamics", "quasistatic"), get_args(ActionKind))
    if setup[2] in kinds_of(setup[0])
    # Energy minimisation knows of no speed; a whole sequence has too many discrete actions.
    and not (setup[0] in TRACKS and setup[1] == "quasistatic")
    and setup[::2] != ("MagFold/SequenceDesign-v0", "discrete")
]
# A million in all: most where steps are cheap.
STEPS = {"dynamics": 8_000, "quasistatic": 80_000}
ROOM = 4e6  # bytes that the process may grow by after a tenth of a setup's steps
FAILING = 3e-3  # share of the episodes that the engine may give up, which it says
MEMORY = Path("/proc/self/statm")


def resident() -> int:
    """Return the resident memory of this process [bytes]; 0 if the system does not report it."""
    if not MEMORY.exists():
        return 0
    return int(MEMORY.read_text(encoding="ascii").split()[1]) * mmap.PAGESIZE


def random_steps(env_id: str, fidelity: str, actions: str, steps: int) -> None:
    env = gymnasium.make(env_id, fidelity=fidelity, actions=actions, randomisation="strong")
    env.action_space.seed(0)
    observation, _ = env.reset(seed=0)
    finished = failed = early = 0
    for k in range(steps):
        if k == steps // 10:
            early = resident()
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert observation in env.observation_space
        assert -1.0 <= float(reward) <= 1.0
        if terminated or truncated:
            finished += 1
            failed += terminated and info["status"] == "failed"
            observation, _ = env.reset()
            assert observation in env.observation_space
    assert finished > 0
    assert failed <= FAILING * finished
    assert resident() - early < ROOM


@pytest.mark.parametrize("some", [True, pytest.param(False, marks=pytest.mark.weekly)])
@pytest.mark.parametrize(("env_id", "fidelity", "actions"), WORLDS)
def test_random_steps(env_id: str, fidelity: str, actions: str, some: bool) -> None:
    # The time of some tracks is over after so many steps, a sequence is folded in one.
    few = {"UnknownFloor": 251, "Reprogram": 501, "Lumen": 251, "SequenceDesign": 25}
    steps = 750 if fidelity == "quasistatic" else few.get(env_id[8:-3], 150)
    random_steps(env_id, fidelity, actions, steps if some else STEPS[fidelity])


@pytest.mark.slow
@pytest.mark.parametrize(("env_id", "fidelity"), dict.fromkeys(setup[:2] for setup in WORLDS))
def test_memory_stays_flat(env_id: str, fidelity: str) -> None:
    # Few targets or tasks: what is kept of each is found in the first episodes.
    env = gymnasium.make(env_id, fidelity=fidelity, difficulty=0.05)
    env.action_space.seed(0)

    def play(episodes: int) -> None:
        for _ in range(episodes):
            env.reset()
            ended = False
            while not ended:
                _, _, terminated, truncated, _ = env.step(env.action_space.sample())
                ended = terminated or truncated

    env.reset(seed=0)
    play(10)
    tracemalloc.start()
    try:
        held: list[int] = []
        for _ in range(8):
            play(4)
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    # What leaks does so every time; what is looked up once and kept, or another thread's, does not.
    assert min(after - before for before, after in pairwise(held)) < 20_000
