"""Ctrl-C ends commands that simulate what takes minutes, at once."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import magfold_env as mf

COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # where tests run in the background
from magfold_env.cli.app import app
app()
"""
LONG = mf.Scene(sequence=("SNNS", "SNNN", "NNSN"), mount="tube", friction=0.2).replace(
    feed={"speed": 1e-6}
)
"""Takes minutes: 0.001 mm/s."""


@pytest.mark.medium
@pytest.mark.parametrize("arguments", [
    ("ensemble", "scene.yaml", "--workers", "1"),
    ("ensemble", "scene.yaml", "--workers", "2", "--backend", "threads"),
    ("ensemble", "scene.yaml", "--workers", "2", "--backend", "processes"),
])  # fmt: skip
def test_ctrl_c_ends_a_long_command(arguments: tuple[str, ...], tmp_path: Path) -> None:
    mf.save_scene(LONG, tmp_path / "scene.yaml")
    mf.simulate(LONG.replace(feed={"speed": 0.1}))  # compiles
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *arguments], cwd=tmp_path, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    time.sleep(6.0)
    assert process.poll() is None
    os.killpg(process.pid, signal.SIGINT)
    try:
        _, errors = process.communicate(timeout=20.0)
    finally:
        process.kill()
    assert process.returncode == 130
    assert errors.endswith("interrupted\n")
