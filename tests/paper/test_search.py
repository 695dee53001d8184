"""The search over sequences and what they are released with: rounds, and going on."""

from pathlib import Path

import pytest
from rich.progress import Progress

from magfold_bench.laws.experiment import SPEED
from magfold_bench.paper import search
from magfold_bench.paper.candidates import Candidate
from magfold_bench.paper.search import ALTERNATIVE, SHIPPED, STRONG, Round
from magfold_bench.paper.states import names
from magfold_env.scene import load_scene


def shipped(side: float, inset: float, number: int) -> list[Candidate]:
    found = {name: word for word, name in names(number).items()}
    return [Candidate(number, search.today(number), found, frozenset(found.values()))]


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "candidates", shipped)
    monkeypatch.setattr(search, "GEOMETRIES", ((0.0125, 0.0005),))
    monkeypatch.setattr(search, "RATIOS", (0.07, 1.0))
    monkeypatch.setattr(search, "SPEEDS", (0.3,))
    monkeypatch.setattr(search, "ROUNDS", (Round(1, 1, 2),))
    monkeypatch.setattr(search, "CHAIN_WORDS", 1)
    monkeypatch.setattr(search, "CHAIN_RUNS", 1)


@pytest.mark.medium
@pytest.mark.usefixtures("small")
def test_rounds_keep_what_is_best_and_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Progress(disable=True) as progress:
        first, last = search.search(tmp_path, progress)
    assert [len(first), len(last)] == [2, 1]
    assert last[0].point == first[0].point
    assert first[0].total >= first[1].total
    row = search.record(last[0])
    assert row["of"] == len(row["degrees"])
    assert row["meets"] + len(row["gives"]) == row["of"]
    assert set(row["degrees"]) <= set(search.said())

    def refuse(*args: object) -> None:
        raise AssertionError("nothing is released again")

    monkeypatch.setattr("magfold_env.ensembles.releases.run_one", refuse)
    with Progress(disable=True) as progress:
        again = search.search(tmp_path, progress)
    assert [search.record(each) for each in again[1]] == [row]


@pytest.mark.parametrize(
    ("point", "name", "speed"),
    [
        (SHIPPED, "sequence-1", SPEED),
        (STRONG, "sequence-1-strong", SPEED),
        (ALTERNATIVE, "alternative-1", 0.32),
    ],
)
def test_points_are_those_of_the_shipped_scenes(
    point: search.Point, name: str, speed: float
) -> None:
    scene = load_scene(f"paper/{name}")
    at = search.scene_at(point, "forward")
    assert scene.magnets is not None
    assert scene.magnets.remanence == pytest.approx((scene.frictions[0] / at.frictions[0]) ** 0.5)
    assert at.feed.speed * (scene.frictions[0] / at.frictions[0]) ** 0.5 == pytest.approx(speed)
    assert at.casing == scene.casing
