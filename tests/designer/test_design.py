"""Tests of `design`: its result, errors, stored state and repeatability."""

from pathlib import Path
from typing import Any

import pytest

import magfold_env as mf
from magfold_env.designer.trials import score_of

SMALL = mf.load_scene("design").replace(sequence=("NNNN",) * 4)


def test_a_design_folds_into_its_target() -> None:
    design: Any = mf.design("LRR", SMALL, "forward", runs=30)
    assert design.reached
    assert design.scene.mount == "tube"
    assert design.scene.feed.direction == "forward"
    assert design.speed == design.scene.feed.speed
    assert design.score is not None
    assert design.score == design.probability.rate >= 0.9
    again = mf.ensemble(design.scene, 30, design.releases_seed)
    assert again.probability("LRR", "folded") == design.probability
    assert design.shortfall == pytest.approx(1.0 - design.score)
    assert design.calls["releases"] > 0


@pytest.mark.parametrize("mode", ["free", "backward"])
def test_every_mode_releases_its_own_way(mode: Any) -> None:
    design: Any = mf.design("LLR", SMALL, mode, runs=10)
    assert design.scene.mount == ("free" if mode == "free" else "tube")
    assert design.reached
    assert (design.speed is None) == (mode == "free")


@pytest.mark.medium
@pytest.mark.parametrize("search", ["exhaustive", "annealing"])
@pytest.mark.parametrize("objective", ["ground", "gap", "unique", "sensitivity"])
def test_objectives_of_energy_are_met(objective: Any, search: Any) -> None:
    design = mf.design("LRR", SMALL, objective=objective, search=search, runs=0)
    assert design.reached
    evidence: Any = design.evidence
    assert design.probability is None
    scene = SMALL.replace(sequence=design.sequence)
    lowest, second = mf.minimise(scene, top=2).states
    stable = [state.word for state in mf.minimise(scene, among="stable", top=9).states]
    assert evidence.ground == (lowest.word == "LRR")
    assert evidence.gap == pytest.approx(second.energy - lowest.energy, rel=1e-9)
    assert evidence.only_stable == (stable == ["LRR"])
    if objective == "unique":
        assert evidence.only_stable
    proved = search == "exhaustive" and objective in ("gap", "sensitivity")
    assert design.shortfall == (0.0 if proved else None)
    expected = evidence.tolerance if objective == "sensitivity" else evidence.gap
    assert design.score == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("target", "objective", "message"), [
    ("LLLL", "probability", "components 1 and 5 would lie in one place"),
    ("LLLL", "gap", "components 1 and 5 would lie in one place"),
    ("LSR", "probability", "joint 2 is straight"),
    ("LSR", "unique", "joint 2 is straight"),
])  # fmt: skip
def test_what_cannot_be_is_certified(target: str, objective: Any, message: str) -> None:
    design = mf.design(target, SMALL, objective=objective)
    assert not design.reached
    assert design.scene is None
    assert design.shortfall is None
    assert message in design.certificate
    with pytest.raises(ValueError, match=message):
        _ = design.sequence


@pytest.mark.medium
def test_the_same_seed_gives_the_same_design_however_many_work() -> None:
    def find(**more: Any) -> mf.Design:
        return mf.design("LLR", SMALL, seed=5, runs=12, search="annealing", **more)

    assert find(workers=1) == find(workers=3) == find(workers=2, backend="processes")
    assert find(workers=1).releases_seed != mf.design("LLR", SMALL, seed=6, runs=1).releases_seed


def test_a_score_is_one_only_for_the_target() -> None:
    design: Any = mf.design("LRR", SMALL, runs=0)
    fold = mf.simulate(design.scene, seed=0)
    assert fold.status is mf.FoldStatus.FOLDED
    assert score_of(fold, "LRR") == 1.0
    assert 0.0 < score_of(fold, "LRL") < score_of(fold, "LRR") / 2


def test_a_design_is_kept_in_a_file(tmp_path: Path) -> None:
    for design in (mf.design("LR", SMALL, runs=5), mf.design("LLLL", SMALL)):
        path = tmp_path / "design.json"
        design.to_json(path)
        assert mf.Design.from_json(path) == design


@pytest.mark.parametrize(("changes", "message"), [
    ({"speeds": (0.1, 1e9)}, r"feed.speed: 1000000000.0 .* at most 20 m/s$"),
    ({"speeds": (0.1,), "mode": "free"}, "speeds: .* must be left out unless a tube feeds"),
    ({"speeds": (0.1,), "objective": "gap"}, "speeds: .* must be left out unless"),
    ({"search": "cross-entropy", "objective": "gap"}, "must be exhaustive or annealing"),
    ({"search": "exhaustive", "target": "LRLRLR"}, "must be annealing or cross-entropy"),
    ({"scene": SMALL.replace(field={"uniform": (1e-3, 0.0)})}, "field: .* is not allowed"),
])  # fmt: skip
def test_wrong_arguments_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        mf.design(**{"target": "LR", "scene": SMALL, **changes})
