"""Directories of compiled kernels: one for every version of the sources, none kept for ever."""

import os
import time

from magfold_env.engine.compile.kernel_cache import KEPT, cache_directory, mark_used, remove_unused


def aged(path, seconds):
    path.mkdir()
    (path / "kernel.nbc").write_bytes(b"code")
    os.utime(path, (time.time() - seconds,) * 2)
    return path


def test_the_environment_moves_the_root(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert cache_directory().parent == tmp_path
    assert cache_directory().name.startswith("kernels-")


def test_only_directories_of_kernels_long_unused_are_removed(tmp_path):
    mine = aged(tmp_path / f"kernels-{'0' * 16}", 2.0 * KEPT)
    old = aged(tmp_path / f"kernels-{'a' * 16}", 1.1 * KEPT)
    recent = aged(tmp_path / f"kernels-{'b' * 16}", 0.9 * KEPT)
    other = aged(tmp_path / "kernels-of-others", 2.0 * KEPT)
    remove_unused(mine)
    assert not old.exists()
    assert all(path.exists() for path in (mine, recent, other))


def test_use_keeps_a_directory(tmp_path):
    old = aged(tmp_path / f"kernels-{'a' * 16}", 2.0 * KEPT)
    mark_used(old)
    remove_unused(tmp_path / f"kernels-{'0' * 16}")
    assert old.exists()
    mark_used(tmp_path / "not there")
