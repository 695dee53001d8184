"""Tests that Ctrl-C immediately ends commands that simulate for minutes."""

import os
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

import magfold_env as mf
from tests.command_line import interrupt_import

ROOT = Path(__file__).parents[2]
COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # where tests run in the background
from magfold_env.cli.app import app
app()
"""
LONG = mf.Scene(sequence=("SNNS", "SNNN", "NNSN"), mount="tube", friction=0.2).replace(
    feed={"speed": 1e-6}
)
"""A feed of 0.001 mm/s, which takes minutes."""


def test_ctrl_c_in_imports_ends_the_command_quietly(tmp_path: Path) -> None:
    interrupt_import("magfold_env.cli.options", tmp_path)
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    module, _, name = settings["project"]["scripts"]["magfold"].partition(":")
    done = subprocess.run(
        [sys.executable, "-c", f"from {module} import {name}; {name}()", "scenes"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


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
