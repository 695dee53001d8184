import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.baselines import baseline
from magfold_env.envs.baselines.baseline import (
    CANDIDATE_SPEEDS,
    SCORING_DRAWS,
    SELECTION_DRAWS,
    BaselineStore,
    baseline_key,
    designs,
    draw_generator,
    evaluate_design,
    unknown_baseline,
)
from magfold_env.envs.tasks.draws import Randomisation, randomised
from magfold_env.envs.tasks.goals import judged
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.shapes import folded_words


def scene_of(n: int, randomisation: Randomisation = "nominal") -> mf.Scene:
    scene = randomised(mf.load_scene("tube-feed"), randomisation)
    return scene.replace(sequence=("NSNS",) * n)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(baseline, "user_cache_path", lambda _name: tmp_path)
    return tmp_path


@pytest.mark.parametrize("randomisation", ["none", "nominal", "strong"])
def test_the_default_env_needs_no_computation(randomisation: Randomisation, cache: Path) -> None:
    env = TubeFeedEnv(randomisation=randomisation)
    for target in env.targets:
        baseline = env.baseline_of(target)
        assert baseline.target == target
        assert 0.0 <= baseline.score <= 1.0
        assert not baseline.flagged
    assert not list(cache.iterdir())


@pytest.mark.medium
def test_shipped_designs_are_the_minimisers() -> None:
    env = TubeFeedEnv()
    for target, sequence in designs(env.scene).items():
        assert env.baseline_of(target).sequence == sequence


@pytest.mark.medium
@pytest.mark.parametrize(("target", "randomisation"), [
    ("LRLLL", "none"),
    ("RLRLR", "none"),
    ("RLRLR", "nominal"),
    pytest.param("LRLLL", "nominal", marks=pytest.mark.slow),
])  # fmt: skip
def test_shipped_numbers_can_be_recomputed(target: str, randomisation: Randomisation) -> None:
    env = TubeFeedEnv(randomisation=randomisation)
    shipped = env.baseline_of(target)
    assert evaluate_design(env.scene, target, shipped.sequence) == shipped


@pytest.mark.medium
def test_the_baseline_is_the_mean_score_at_the_best_speed() -> None:
    scene, target = scene_of(3), "LR"
    sequence: Any = designs(scene)[target]
    baseline: Any = evaluate_design(scene, target, sequence)

    def mean(speed: float, stream: str, draws: int) -> float:
        fed = scene.replace(sequence=sequence, feed={"speed": speed})
        folds = [mf.simulate(fed.draw(draw_generator(stream, index))) for index in range(draws)]
        return float(judged(target, "word", folds)[1].mean())

    selection = [mean(speed, "selection", SELECTION_DRAWS) for speed in CANDIDATE_SPEEDS]
    assert baseline.speed == CANDIDATE_SPEEDS[int(np.argmax(selection))]
    assert baseline.score == mean(baseline.speed, "scoring", SCORING_DRAWS)


def test_without_a_design_the_baseline_is_flagged_and_zero() -> None:
    scene = scene_of(7)
    sequences = designs(scene)
    assert set(sequences) == set(folded_words(7))
    target = "LRLRLR"
    baseline = evaluate_design(scene, target, sequences[target])
    assert baseline == unknown_baseline(target)
    assert baseline.flagged
    assert baseline.score == 0.0


def test_a_missing_baseline_is_computed_once_and_kept(cache, monkeypatch):
    scene = scene_of(3, "none")
    computed = BaselineStore(scene).get("LL")
    (file,) = [path for path in cache.rglob("*") if path.is_file()]
    assert file.name == "LL.json"
    assert baseline_key(scene) in str(file)

    def forbidden(*_arguments: object) -> None:
        raise AssertionError("computed again")

    with monkeypatch.context() as patch:
        patch.setattr(baseline, "evaluate_design", forbidden)
        assert BaselineStore(scene).get("LL") == computed
    whole = file.read_text()
    other = {"target": "LR", "score": None, "success": 2.0, "speed": -0.1, "sequence": "NSNS"}
    changed = (json.dumps({**json.loads(whole), key: value}) for key, value in other.items())
    for wrong in ("", whole[:20], "[]", *changed):
        file.write_text(wrong)
        assert BaselineStore(scene).get("LL") == computed
        assert file.read_text() == whole


def test_a_baseline_that_cannot_be_kept_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    no_folder = tmp_path / "home"
    no_folder.write_text("")
    monkeypatch.setattr(baseline, "user_cache_path", lambda _name: no_folder)
    found = [BaselineStore(scene_of(3, "none")).get(word) for word in ("LL", "LR", "RR")]
    assert [each.target for each in found] == ["LL", "LR", "RR"]
    (told,) = [each.getMessage() for each in caplog.records if each.levelname == "WARNING"]
    assert str(no_folder) in told


def test_baselines_of_words_and_of_outlines_are_kept_apart() -> None:
    scene = mf.load_scene("tube-feed")
    word, outline = (BaselineStore(scene, match) for match in ("word", "outline"))
    assert word.key == BaselineStore(scene).key != outline.key


def test_the_key_covers_the_physics_and_leaves_out_what_the_agent_chooses() -> None:
    scene = scene_of(6)
    key = baseline_key(scene)
    assert baseline_key(scene.replace(sequence=("SSSS",) * 6, feed={"speed": 0.3})) == key
    assert baseline_key(scene.replace(field={"uniform": (0.0, 0.0)})) == key
    others = [
        scene.replace(friction=0.3), scene.replace(field={"uniform": (1e-3, 0.0)}),
        scene.replace(magnets={"remanence": (0.6, 0.6, 0.6, 0.7)}),
        scene.replace(spreads={"mass": 0.1}), scene.replace(feed={"direction": "backward"}),
        scene.replace(start_angle_spread=0.01), scene_of(5),
    ]  # fmt: skip
    assert len({key, *map(baseline_key, others)}) == 1 + len(others)
