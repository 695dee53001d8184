import math
from collections import Counter
from itertools import product

import pytest

import magfold_env as mf
from magfold_env.envs.chains.quasistatic import fold
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.difficulty import difficulties, easiest
from magfold_env.shapes import folded_words, mirror


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
