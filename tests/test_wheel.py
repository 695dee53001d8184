"""Tests of the contents of the wheel."""

import os
from pathlib import Path
from zipfile import ZipFile

import pytest
from hatchling.builders.wheel import WheelBuilder

from tests.command_line import python

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that an installation unpacks."""
    folder = tmp_path_factory.mktemp("wheel")
    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    with ZipFile(wheel) as file:
        file.extractall(folder / "unpacked")
    return folder / "unpacked"


def test_the_wheel_brings_one_package_and_all_of_it(unpacked: Path) -> None:
    (package,) = [each for each in unpacked.iterdir() if each.suffix != ".dist-info"]
    assert package.name == "magfold_env"
    there = {
        path.relative_to(ROOT)
        for path in (ROOT / package.name).rglob("*")
        if path.is_file() and path.parent.name != "__pycache__"
    }
    brought = {path.relative_to(unpacked) for path in package.rglob("*") if path.is_file()}
    assert {path for path in brought if path.parts[1] != "configs"} == there


def printed(unpacked: Path, name: str, arguments: str = "") -> str:
    """Return the result of a function of `magfold_env.files` in the unpacked files."""
    code = f"from magfold_env.files import {name}; print({name}({arguments}))"
    run = python("-c", code, cwd=unpacked.parent, PYTHONPATH=str(unpacked))
    return run.stdout.strip()


def test_the_wheel_has_the_settings_that_it_reads_and_says_how_to_install_more(unpacked):
    assert printed(unpacked, "pip_install", "'render'") == "pip install 'magfold_env[render]'"
    assert printed(ROOT, "pip_install", "'render'") == "pip install -e '.[render]'"
    configs = Path(printed(unpacked, "configs_dir"))
    assert configs == unpacked / "magfold_env" / "configs"
    for name in ("baselines", "scenes", "suites", "tasks"):
        assert sorted(os.listdir(configs / name)) == sorted(os.listdir(ROOT / "configs" / name))
