"""Tests of runs: their parts, stored results, resumption and page."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from magfold_bench.paper import run
from magfold_bench.paper.reproduction import Claim, Measured, Reproduction
from magfold_bench.tables import Progress, Table
from magfold_env.checkpoint import CheckpointError


def nothing(share: float, what: str) -> None:
    assert 0.0 <= share <= 1.0


def part(name: str, measure: Callable[[bool, Progress], Measured]) -> Reproduction:
    return Reproduction(
        name,
        f"Figure {name}: a part",
        "The solver",
        shows="what it shows",
        computed="what is computed",
        missing="what is missing",
        measure=measure,
        tables=lambda measured: [Table("numbers", measured["numbers"])],
        claims=lambda measured: [
            Claim("three.", f"{measured['numbers'][0]['n']}.", measured["numbers"][0]["n"] == 3)
        ],
        plots=lambda measured: [],
        inputs="what it hangs on",
    )


class Counted:
    """A measurement that returns a number, counts its calls, and fails on request."""

    def __init__(self, number: int) -> None:
        self.number, self.calls, self.fails = number, 0, False

    def __call__(self, quick: bool, progress: Progress) -> Measured:
        if self.fails:
            raise KeyboardInterrupt
        self.calls += 1
        progress(0.5, "half")
        return {"numbers": [{"n": self.number}]}


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> tuple[Counted, Counted]:
    three, four = Counted(3), Counted(4)
    parts = {"a": part("a", three), "b": part("b", four)}
    monkeypatch.setattr(run, "PARTS", parts)
    return three, four


def test_a_run_writes_page_and_numbers(two: tuple[Counted, Counted], tmp_path: Path) -> None:
    done = run.run([], True, tmp_path / "out", nothing)
    assert [each.claims[0].outcome for each in done] == ["agrees", "disagrees"]
    text = (tmp_path / "out" / run.PAGE).read_text(encoding="utf-8")
    assert "Figure a" in text
    data = json.loads((tmp_path / "out" / run.NUMBERS).read_text(encoding="utf-8"))
    assert data["parts"]["b"]["measured"] == {"numbers": [{"n": 4}]}
    assert data["parts"]["b"]["claims"][0]["inputs"] == "what it hangs on"
    assert "Depends on: what it hangs on" in text
    assert (tmp_path / "out" / "a-numbers.csv").read_text(encoding="utf-8") == "n\n3\n"


def test_a_killed_run_goes_on_where_it_stopped(two, tmp_path):
    three, four = two
    four.fails = True
    with pytest.raises(KeyboardInterrupt):
        run.run([], False, tmp_path, nothing)
    assert "Figure a" in (tmp_path / run.PAGE).read_text(encoding="utf-8")
    four.fails = False
    assert len(run.run([], False, tmp_path, nothing)) == 2
    assert (three.calls, four.calls) == (1, 1)


def test_parts_join_those_of_the_same_physics_and_effort(two, tmp_path, monkeypatch):
    assert [each.part.name for each in run.run(["b"], False, tmp_path, nothing)] == ["b"]
    assert [each.part.name for each in run.run(["a"], False, tmp_path, nothing)] == ["a", "b"]
    assert [each.part.name for each in run.run(["b"], False, tmp_path, nothing)] == ["a", "b"]
    assert (two[0].calls, two[1].calls) == (1, 1)
    run.run(["a"], True, tmp_path, nothing)  # a quick run is another one
    assert two[0].calls == 2
    monkeypatch.setattr(run, "physics_digest", lambda: "other")
    with pytest.raises(CheckpointError, match=r"whose physics is .* give another folder"):
        run.run(["a"], True, tmp_path, nothing)
