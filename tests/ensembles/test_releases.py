"""Tests of ensembles: equal runs on any workers, and little loss after a kill."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env import files
from magfold_env.ensembles import releases
from magfold_env.ensembles.releases import generator, release

FREE = mf.load_scene("paper/sequence-1").replace(
    spreads=mf.Spreads(friction=0.3, feed_speed=0.3, feed_jitter=0.2, magnet=0.1)
)
TUBE = release(FREE, "backward", speed=0.1)
RUNS = 12


def bits(made: mf.Ensemble) -> tuple[bytes, ...]:
    columns = (made.word, made.status, made.energy, made.time, made.angles)
    return tuple(column.tobytes() for column in columns)


@pytest.fixture(scope="module")
def made() -> mf.Ensemble:
    return mf.ensemble(TUBE, RUNS, seed=3, workers=1)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("workers", "backend"), [(None, "threads"), (2, "threads"), (5, "threads"), (2, "processes")]
)
def test_the_runs_do_not_depend_on_who_makes_them(made, workers, backend):
    again = mf.ensemble(TUBE, RUNS, seed=3, workers=workers, backend=backend)
    assert bits(again) == bits(made)


def test_every_run_can_be_repeated_by_itself(made: mf.Ensemble) -> None:
    children = np.random.SeedSequence(3).spawn(RUNS)
    for k in (0, 5, RUNS - 1):
        for source in (made.generator(k), generator(3, k), np.random.default_rng(children[k])):
            fold = mf.simulate(TUBE, source)
            assert fold.angles.tobytes() == made.angles[k].tobytes()
            assert (fold.word, fold.status) == (made.word[k], made.status[k])
            assert (fold.energy, fold.time) == (made.energy[k], made.time[k])
    recorded: Any = made.replay(-1, frame_rate=100.0)
    assert recorded.angles.tobytes() == made.angles[-1].tobytes()


def test_what_was_made_is_not_made_again(made, tmp_path, monkeypatch):
    mf.ensemble(TUBE, 7, seed=3, state=tmp_path)
    asked: list[int] = []
    real = releases.run_one
    monkeypatch.setattr(releases, "run_one", lambda *task: asked.append(task[-1][0]) or real(*task))
    assert bits(mf.ensemble(TUBE, RUNS, seed=3, state=tmp_path, workers=1)) == bits(made)
    assert asked == list(range(7, RUNS))
    mf.ensemble(TUBE, 4, seed=3, state=tmp_path)
    assert len(asked) == RUNS - 7


def test_an_interrupted_ensemble_keeps_what_it_has(tmp_path: Path) -> None:
    def interrupt(count: int, _: int) -> None:
        if count == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mf.ensemble(FREE, 8, state=tmp_path, workers=1, progress=interrupt)
    again: list[int] = []
    mf.ensemble(FREE, 8, state=tmp_path, progress=lambda count, _: again.append(count))
    assert again == [5, 6, 7, 8]


@pytest.mark.medium
def test_the_digest_follows_the_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(files.PACKAGE, tmp_path / "copy", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(files, "PACKAGE", tmp_path / "copy")
    digest = files.physics_digest.__wrapped__  # anew each time
    first = digest()
    (tmp_path / "copy" / "cli" / "app.py").write_text("")
    kernel = tmp_path / "copy" / "engine" / "chain" / "feed.py"
    source = kernel.read_text()
    kernel.write_text(f'"""Others say it otherwise."""\n# Truly.\n{source}\n\nx = 1.0 # shown\n')
    changed = digest()
    assert changed != first
    kernel.write_text(f'{source}\n# Nor does this.\nx = 1.0 # shown\n"""Nor this.\n\n"""\n')
    assert digest() == changed
    kernel.write_text(source.replace('"""', '"""To begin with: ', 1))
    assert digest() == first
    kernel.write_text(source + "x = 2.0 # shown\n")
    assert digest() not in {first, changed}


# --- releases ------------------------------------------------------------------------------------


def test_releases_change_mount_direction_and_speed_only() -> None:
    for mode in ("forward", "backward"):
        fed = release(FREE, mode, speed=0.2)
        assert (fed.mount, fed.feed.direction, fed.feed.speed) == ("tube", mode, 0.2)
        assert release(fed, "free", speed=0.05) == FREE.replace(feed={"direction": mode})
    assert release(TUBE, "backward") == TUBE
    with pytest.raises(mf.SceneError, match="mode: 'up' is not allowed; must be one of free, for"):
        release(FREE, "up")  # pyright: ignore[reportArgumentType]
