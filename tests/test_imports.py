"""Tests of what importing the package loads, and of its first use."""

import pickle

import pytest

import magfold_env as mf
from tests.command_line import python

PACKAGE = "import magfold_env"
PUBLIC = "from magfold_env import *"
NEVER = "torch stable_baselines3 pygame matplotlib moviepy PIL joblib ray scipy.stats"
AT_FIRST_USE = "numba llvmlite scipy pydantic magfold_env.engine magfold_env.scene"

LOADED = "import sys; print(*(name for name in {!r}.split() if name in sys.modules))"


@pytest.mark.parametrize(
    ("statement", "names"), [(PACKAGE, f"{NEVER} {AT_FIRST_USE}"), (PUBLIC, NEVER)]
)
def test_nothing_heavy_is_loaded(statement: str, names: str) -> None:
    assert python("-c", f"{statement}\n{LOADED.format(names)}").stdout.split() == []


def test_every_public_name_is_there_and_listed() -> None:
    assert mf.__all__ == sorted(mf.__all__)
    for name in mf.__all__:
        assert getattr(mf, name).__name__ == name
    assert set(mf.__all__) <= set(dir(mf))
    with pytest.raises(AttributeError, match="module 'magfold_env' has no attribute 'Scenes'"):
        mf.Scenes  # noqa: B018  # pyright: ignore


@pytest.mark.parametrize(("code", "printed"), [
    ("import magfold_env.minimiser as e; print(e.__name__)", "magfold_env.minimiser"),
    ("import magfold_env as mf; print(mf.scene.__name__)", "magfold_env.scene"),
    ("import magfold_env.simulation.simulate, magfold_env as mf; print(mf.energy.__name__)",
     "energy"),
    ("from magfold_env import files; print(files.__name__)", "magfold_env.files"),
])  # fmt: skip
def test_packages_and_functions_keep_their_names(code: str, printed: str) -> None:
    assert python("-c", code).stdout.strip() == printed


@pytest.mark.medium
@pytest.mark.parametrize("code", [
    "import magfold_env, gymnasium; made = gymnasium.make('MagFold/TubeFeed-v0')",
    "import gymnasium; made = gymnasium.make('magfold_env:MagFold/TubeFeed-v0')",
    "import magfold_env, gymnasium; made = gymnasium.make_vec('MagFold/TubeFeed-v0', 2)",
])  # fmt: skip
def test_environments_are_found_by_their_ids(code: str) -> None:
    assert python("-c", f"{code}; print(made.spec.id)").stdout == "MagFold/TubeFeed-v0\n"


def test_pickles_are_read_where_only_the_package_is_imported() -> None:
    data = pickle.dumps(mf.Scene(sequence=("NSNS", "SN-N")))
    code = f"import pickle, magfold_env; print(pickle.loads({data!r}).sequence)"
    assert python("-c", code).stdout.strip() == "('NSNS', 'SN-N')"
