"""Maps over friction and speed: two numbers stand for three, and what a map is made of."""

from pathlib import Path

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.experiment import paper_scene
from magfold_bench.paper import maps
from magfold_env.minimiser import Mode
from magfold_env.reporting.page import PNG_START
from magfold_env.reporting.tables import select


@pytest.mark.parametrize(("number", "mode"), [(1, "free"), (2, "forward"), (3, "backward")])
def test_only_friction_over_remanence_squared_and_speed_over_remanence_count(
    number: int, mode: Mode
) -> None:
    scene = paper_scene(number, mode).replace(friction=0.35)
    scene = scene.replace(magnets={"remanence": 0.6}, feed={"speed": 0.05})
    twice = scene.replace(magnets={"remanence": 1.2}, friction=1.4, feed={"speed": 0.1})
    one, other = (mf.ensemble(each, runs=8, workers=1) for each in (scene, twice))
    assert one.word.tolist() == other.word.tolist()
    assert one.status.tolist() == other.status.tolist()
    # The tolerances of the solver are the same for both, so that not all bits are.
    np.testing.assert_allclose(one.time, 2.0 * other.time, rtol=0.05)
    np.testing.assert_allclose(4.0 * one.energy, other.energy, rtol=1e-3)


@pytest.mark.medium
def test_a_map_has_all_releases_at_every_point(tmp_path: Path) -> None:
    found = [row for mode in ("free", "forward") for row in maps.rows(3, mode, quick=True)]
    for ratio in maps.QUICK_RATIOS:
        for mode, speeds in (("free", (0.0,)), ("forward", maps.QUICK_SPEEDS)):
            for speed in speeds:
                here = select(found, {maps.RATIO: ratio, maps.SPEED: speed}, mode=mode)
                assert [row["ends in"] for row in here] == ["S3A", maps.OTHER, maps.MISFOLDED]
                assert sum(float(row["share"]) for row in here) == pytest.approx(1.0)
    (best,) = select(maps.best_table(found).rows, {"ends in": "S3A"}, mode="free")
    assert best["most"] == "100 %"
    for plot in maps.plots([*found, *maps.rows(3, "backward", quick=True)], "figure"):
        path = tmp_path / f"{plot.name}.png"
        plot.save(path)
        assert path.read_bytes().startswith(PNG_START)
