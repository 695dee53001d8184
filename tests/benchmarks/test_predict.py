"""`magfold bench predict`: its parts, on few releases."""

import numpy as np

from magfold_bench import idealisations


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
