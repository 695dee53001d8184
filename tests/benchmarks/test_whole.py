"""`magfold bench whole`: its scenes, settings and floor, and a small run of both parts."""

from __future__ import annotations

import numpy as np
import pytest

from magfold_bench import bare_pendulum, parts, runs, skipping, work_precision
from magfold_bench.parts import BENCHMARKS
from magfold_bench.runs import Setting, difference, recorded
from magfold_bench.work_precision import (
    BEHIND,
    END,
    WAY,
    Effort,
    fastest,
    settings_of,
    without_luck,
)
from magfold_env.scene import Magnets, Scene, Solver
from magfold_env.simulation.session import Session

SMALL = Effort(2, (1e-2, 1e-4), (1e-2, 1e-3), (1 / 1200,), (1e-7, 1e-6), 2)


def swinging(n: int = 3, duration: float = 0.5) -> Scene:
    pendulum = work_precision.named_scenes()[work_precision.PENDULUM]
    start = tuple(0.1 * (-1) ** k for k in range(n - 1))
    return pendulum.replace(sequence=("NNNN",) * n, start_angles=start, duration=duration)


def drawn(scene: Scene, seed: int) -> Scene:
    return scene.draw(np.random.default_rng(seed))


def test_ten_scenes_have_every_mount_and_the_default_settings() -> None:
    named = work_precision.named_scenes()
    assert len(named) == 10
    assert {scene.mount for scene in named.values()} == {"pinned", "free", "tube"}
    assert len({scene.model_dump_json() for scene in named.values()}) == 10
    for scene in named.values():
        assert scene.solver == Solver()
        assert drawn(scene, 1).is_concrete
        assert drawn(scene, 1) != drawn(scene, 2)
        every = settings_of(scene, (1e-3, Solver().tolerance), (1e-2, 1e-3), (1e-3,))
        assert sum(each.is_default for each in every) == 1
        assert any(each.method == "paper" for each in every) == (scene.mount == "pinned")


def test_a_setting_changes_only_what_it_sets() -> None:
    scene = work_precision.named_scenes()["sequence 3, pinned"]
    changed = Setting("paper", 1e-3, 1e-2).on(scene)
    assert (changed.solver.method, changed.solver.time_step) == ("paper", 1e-3)
    assert changed.magnets is not None
    assert changed.magnets.accuracy == 1e-2
    back = changed.replace(solver=Solver(), magnets={"accuracy": Magnets().accuracy})
    assert back == scene
    loose, tight = Setting("adaptive", 1e-3, 1e-2), Setting("adaptive", 1e-4, 1e-2)
    assert tight.as_tight(loose)
    assert not loose.as_tight(tight)
    assert not Setting("adaptive", 1e-4, 1e-1).as_tight(loose)


def test_the_fastest_is_among_those_that_are_as_exact() -> None:
    times, errors = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.2, 0.1])
    assert [fastest(times, errors, error) for error in errors] == [0, 1, 2]
    assert fastest(times[::-1].copy(), errors, 0.3) == 2


def test_an_error_that_tighter_settings_miss_is_luck() -> None:
    every = [Setting("adaptive", t, a) for a in (1e-2, 1e-3) for t in (1e-2, 1e-3, 1e-4)]
    errors = np.array([1e-5, 3e-2, 2e-3, 5e-1, 1e-3, 1e-4])
    assert without_luck(every, errors).tolist() == [5e-1, 3e-2, 2e-3, 5e-1, 1e-3, 1e-4]


@pytest.mark.parametrize("n", [1, 3])
def test_the_floor_takes_the_engines_steps(n: int) -> None:
    scene = swinging(n)
    session = Session(scene)
    session.settle()
    bare = bare_pendulum.pendulum(scene)
    assert bare_pendulum.swing(bare, scene.duration) == session.evaluations
    assert np.abs(bare.q - session.angles).max() < 1e-9
    assert np.abs(bare.v - session.rates).max() < 1e-6


def test_the_floor_refuses_what_it_cannot_do() -> None:
    for changes in ({"magnets": {}}, {"friction": 0.1}, {"contact": True}, {"mount": "free"}):
        with pytest.raises(ValueError, match="must be a drawn, pinned chain"):
            bare_pendulum.pendulum(swinging().replace(**changes))


def test_features_go_one_by_one_and_together() -> None:
    found = skipping.variants()
    names = list(skipping.SWITCHED_OFF)
    groups = [each.group for each in found]
    assert groups.count(skipping.ONE) == groups.count(skipping.TOGETHER) == len(names)
    whole, bare = found[0], found[-1]
    bare_pendulum.pendulum(bare.scene)  # nothing is left of it but a pendulum
    assert not bare.recorded
    for feature, each in zip(names, found[1:], strict=False):
        assert (each.recorded, each.scene == whole.scene) == (
            (False, True) if feature == skipping.RECORDING else (True, False)
        )
        assert each.scene == whole.scene.replace(**skipping.SWITCHED_OFF[feature])


def test_a_run_is_compared_at_common_times() -> None:
    scene = drawn(work_precision.named_scenes()[work_precision.PENDULUM], 0)
    exact = work_precision.reference(scene, 1e-8, 1e-6)
    assert 0.0 < exact.known < runs.NUDGE < exact.sensitivity < runs.CLOSE
    assert exact.error_on_the_way(exact.fold) == runs.NUDGE
    errors = [
        exact.error_on_the_way(recorded(Setting("adaptive", t, None).on(scene)))
        for t in (1e-2, 1e-3, 1e-4)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-3
    # Its frames lie at the ends of its own steps, here longer than a frame's time.
    coarse = recorded(Setting("paper", 2e-3, None).on(swinging(1, 0.2)))
    fine = recorded(Setting("paper", 1e-5, None).on(swinging(1, 0.2)))
    assert difference(coarse, fine) == 0.0  # one component has no joint
    two = [recorded(Setting("paper", h, None).on(swinging(2, 0.03))) for h in (2e-3, 1e-3)]
    best = recorded(Setting("paper", 1e-6, None).on(swinging(2, 0.03)))
    off = [difference(each, best) for each in two]
    assert 1.5 < off[0] / off[1] < 2.5  # of first order, frames included


@pytest.mark.medium
def test_work_precision_has_every_setting(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib.figure")
    named = work_precision.named_scenes()
    few = {name: named[name] for name in ("sequence 1, free", work_precision.PENDULUM)}
    monkeypatch.setattr(work_precision, "named_scenes", lambda: few)
    monkeypatch.setattr(work_precision, "QUICK", SMALL)
    shares: list[float] = []
    part = work_precision.run(True, lambda share, _: shares.append(share))
    assert shares == sorted(shares)
    assert all([row["scene"] for row in table.rows] == list(few) for table in part.tables)
    for name in few:
        mine = [row for row in part.rows if row["scene"] == name]
        assert len(mine) == (4 if name == "sequence 1, free" else 3)
        assert sum(int(row["default"]) for row in mine) == 1
        assert all(float(row["time [ms]"]) > 0.0 for row in mine)
        default = next(row for row in mine if row["default"])
        assert float(default[WAY]) < 1e-2
        assert float(default[END]) <= float(default[WAY])
    behind = [float(str(row[BEHIND]).split()[0]) for row in part.tables[1].rows]
    assert min(behind) >= 1.0
    said = " ".join(part.findings)
    assert said.count("the default takes at most") == 3
    assert said.count("set aside") == 2
    assert said.count("the paper's solver") == 1
    drawn = parts.draw("work-precision", BENCHMARKS["whole"]["work-precision"], part, tmp_path)
    assert [path.name for path in drawn] == ["work-precision.png"]


@pytest.mark.slow
def test_skipping_has_a_row_a_variant_and_the_floor() -> None:
    part = skipping.run(True, lambda *_: None)
    assert len(part.rows) == len(skipping.variants()) + 1
    floors = part.rows[-1]
    bare = part.rows[-2]
    assert bare["evaluations"] == floors["evaluations"]
    assert floors["over the floor"] == 1.0
    assert float(bare["over the floor"]) > 1.0
    assert "1.1 is asked for" in part.findings[0]


def test_no_accuracy_is_chosen_where_there_is_none() -> None:
    named = work_precision.named_scenes()
    without = {name for name, scene in named.items() if not runs.has_accuracy(scene)}
    assert without == {work_precision.PENDULUM, "sequence 3, literal"}
