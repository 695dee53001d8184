"""Sequences that are proposed before any is released."""

import magfold_env as mf
from magfold_env.designer.search import stable_sequences
from magfold_env.designer.task import Task, task_for

TARGET = "LRRLLRL"


def task(seed: int) -> Task:
    return task_for(
        TARGET, None, "forward", "probability",
        search="annealing", seed=seed, speeds=None, budget=1, goal=0.9, runs=0,
    )  # fmt: skip


def test_what_is_drawn_holds_its_target_and_differs() -> None:
    drawn = stable_sequences(task(0))
    assert len(set(drawn)) == len(drawn) >= 20
    for sequence in drawn[:5]:
        scene = mf.load_scene("design-long").replace(sequence=sequence)
        stable = mf.ground_state(scene, top=2, among="stable").states
        assert [state.word for state in stable] == [TARGET]


def test_a_seed_draws_the_same_again() -> None:
    assert stable_sequences(task(3)) == stable_sequences(task(3)) != stable_sequences(task(4))
