"""Under which keys baselines are kept."""

import magfold_env as mf
from magfold_env.envs.baselines.baseline import BaselineStore


def test_baselines_of_words_and_of_outlines_are_kept_apart() -> None:
    scene = mf.load_scene("tube-feed")
    word, outline = (BaselineStore(scene, match) for match in ("word", "outline"))
    assert word.key == BaselineStore(scene).key != outline.key
