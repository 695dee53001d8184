import math
from collections import Counter
from itertools import product
from pathlib import Path
from typing import Any

import pytest

import magfold_env as mf
from magfold_env.envs.chains.quasistatic import fold
from magfold_env.envs.sequence_design import SequenceDesignEnv
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.targets import difficulties, easiest, pick_target, resolve_targets
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.shapes import folded_words, mirror


@pytest.mark.parametrize(("targets", "named"), [
    (["LRLL"], "'LRLL'"),  # a letter short
    (["LRSLL"], "'LRSLL'"),  # not fully folded
    (["LLLLL"], "'LLLLL'"),  # overlaps
    (["LRLLX"], "'LRLLX'"),
    ("LRLLL", "'LRLLL'"),  # a word, not a list of words
    ([], r"\[\]"),
])  # fmt: skip
def test_wrong_targets_are_named(targets: list[str], named: str) -> None:
    with pytest.raises(ValueError, match=rf"targets: {named} is not allowed; must be"):
        resolve_targets(targets, 6)


def test_wrong_options_and_suites_are_named_with_what_is_allowed() -> None:
    with pytest.raises(ValueError, match=r"options\['target'\]: 'LLRRL' .* one of LRLLL, LRLRL"):
        pick_target("LLRRL", ("LRLLL", "LRLRL"))
    with pytest.raises(ValueError, match=r"one of LRLLL, LRLRL; did you mean LRLRL\?$"):
        pick_target("lrlrl", ("LRLLL", "LRLRL"))
    with pytest.raises(ValueError, match="targets: 'LRLLL' is not allowed; must be a list of fold"):
        TubeFeedEnv(targets="LRLLL")


def test_targets_are_all_words_or_a_list_in_its_order_which_long_chains_need() -> None:
    assert resolve_targets(None, 6) == tuple(folded_words(6))
    assert resolve_targets(["RRRLR", "LRLLL"], 6) == ("RRRLR", "LRLLL")
    word = ("LR" * 20)[:29]
    assert resolve_targets([word], 30) == (word,)
    with pytest.raises(ValueError, match="targets: None is not allowed with 30 components"):
        resolve_targets(None, 30)
    with pytest.raises(ValueError, match="targets: 'LRLR' is not allowed; must be a fully"):
        resolve_targets(["LRLR"], 30)


def test_a_suite_gives_targets_length_and_scene(tmp_path: Path) -> None:
    path = tmp_path / "slippery.yaml"
    path.write_text("scene_name: design-long\nwords: {LRLR: {}, LLRL: {}}\n")
    env = TubeFeedEnv(targets=str(path), baseline=None)
    assert env.targets == ("LRLR", "LLRL")
    assert env.scene.n == 5
    assert env.scene.friction == mf.load_scene("design-long").friction
    assert env.scene.feed.loading == "at_mouth"
    assert TubeFeedEnv("tube-feed", targets=str(path), baseline=None).scene.friction == 0.35


@pytest.mark.parametrize("make", [TubeFeedEnv, SequenceDesignEnv])
def test_the_shipped_suite_is_the_default_by_another_name(make: Any) -> None:
    suite, default = make(targets="n6"), make()
    assert suite.targets == default.targets
    for target in ("LRLLL", "RRRLR"):
        assert suite.baseline_of(target) == default.baseline_of(target)


@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("n", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_difficulty_is_how_rare_a_word_is(n: int, direction: str) -> None:
    scene = mf.load_scene("tube-feed").replace(
        sequence=("NSNS",) * n, feed={"direction": direction}
    )
    exact = Counter(
        fold(scene.replace(sequence=sequence)).word for sequence in product(PATTERNS, repeat=n)
    )
    found = difficulties(scene, tuple(folded_words(n)))
    for word, value in found.items():
        assert value == pytest.approx(-math.log(exact[word] / 16**n), abs=0.15)


def test_mirror_images_are_equally_hard() -> None:
    words = tuple(folded_words(6))
    found = difficulties(mf.load_scene("tube-feed"), words)
    for word in words:
        assert found[word] == pytest.approx(found[mirror(word)], abs=0.4)


def test_the_easiest_come_in_the_order_given() -> None:
    scene, words = mf.load_scene("tube-feed"), tuple(folded_words(6))
    hardness = difficulties(scene, words)
    half = easiest(scene, words, 0.5)
    assert len(half) == 13
    assert list(half) == [word for word in words if word in half]
    assert max(hardness[w] for w in half) <= min(hardness[w] for w in set(words) - set(half))
    assert len(easiest(scene, words, 1e-6)) == 1
    assert easiest(scene, words, 1.0) == words
