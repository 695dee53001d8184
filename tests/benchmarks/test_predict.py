"""`magfold bench predict`: its parts, on few releases."""

import numpy as np

import magfold_env as mf
from magfold_bench import idealisations
from magfold_bench.laws import experiment


def test_releases_by_hand_vary_in_all_that_is_stated() -> None:
    for mode in experiment.MODES:
        scene = experiment.paper_scene(2, mode)
        assert scene.spreads == experiment.SPREADS
        assert scene.start_angle_spread == experiment.ANGLE
        assert scene.sequence == mf.load_scene("paper/sequence-2").sequence
        assert scene.mount == ("free" if mode == "free" else "tube")


def test_each_change_is_of_one_part_of_a_scene() -> None:
    parts = ["gravity", "friction", "friction", "magnets", "magnets", "magnets", "casing", "casing"]
    for scene in idealisations.random_chains(3) + idealisations.designed_chains(3):
        start = "start_offsets" if scene.mount == "tube" else "start_angles"
        for change, part in zip(
            idealisations.CHANGES.values(), [*parts, start, "solver"], strict=True
        ):
            changed = change(scene, np.random.default_rng((1, 0)))
            assert changed.is_concrete
            assert changed != scene
            assert changed.replace(**{part: getattr(scene, part)}) == scene
