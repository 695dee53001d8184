"""Tests of statements about energies, and of the release settings of shipped sequences."""

import pytest

import magfold_env as mf
from magfold_bench.laws.experiment import SEQUENCES, SPEED
from magfold_bench.paper import judge
from magfold_bench.paper.quoted import TABLE_1


@pytest.mark.parametrize("number", SEQUENCES)
@pytest.mark.parametrize("name", ["sequence", "alternative"])
def test_shipped_sequences_meet_what_is_said_of_energies(name: str, number: int) -> None:
    faces = judge.sequence(name, number)
    names, stable, holds = judge.energies(number, faces)
    assert all(holds.values())
    assert names[f"S{number}A"] in stable
    scene = mf.load_scene("paper/sequence-1-literal").replace(sequence=faces)
    for direction, state in TABLE_1[number].items():
        assert mf.minimise(scene, direction).best.word == names[state]


def test_another_sequence_does_not() -> None:
    _, _, holds = judge.energies(1, judge.sequence("sequence", 2))
    assert not all(holds.values())


@pytest.mark.parametrize(("device", "name", "speed"), [
    ("sequence-k", "sequence-1", SPEED),
    ("sequence-k-strong", "sequence-1-strong", SPEED),
    ("alternative-k", "alternative-1", 0.32),
])  # fmt: skip
def test_points_are_those_of_the_shipped_scenes(device: str, name: str, speed: float) -> None:
    scene = mf.load_scene(f"paper/{name}")
    at = judge.scene_at(judge.POINTS[device][1], "forward")
    assert scene.magnets is not None
    assert scene.magnets.remanence == pytest.approx((scene.frictions[0] / at.frictions[0]) ** 0.5)
    assert at.feed.speed * (scene.frictions[0] / at.frictions[0]) ** 0.5 == pytest.approx(speed)
    assert at.casing == scene.casing


@pytest.mark.medium
def test_every_statement_has_a_degree(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("RUNS", 2), ("CHAIN_WORDS", 1), ("CHAIN_RUNS", 1)):
        monkeypatch.setattr(judge, name, value)
    *rows, last = judge.shipped()
    assert len(rows) == 23
    for device in judge.POINTS:
        found = [float(row[device]) for row in rows]
        assert all(0.0 <= degree <= 1.0 for degree in found)
        assert 0 < int(last[device]) <= 23
