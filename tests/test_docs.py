"""Tests of the site: public names are documented, and examples run."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest
from gymnasium import Wrapper
from gymnasium.vector import VectorWrapper

import magfold_env as mf
from magfold_env.envs import wrappers

DOCS = Path(__file__).parents[1] / "docs"


def told() -> str:
    """Return the pages of the Python reference."""
    return "\n".join(page.read_text("utf-8") for page in (DOCS / "reference").glob("*.md"))


@pytest.mark.parametrize("name", mf.__all__)
def test_what_is_public_is_in_the_reference(name: str) -> None:
    assert re.search(rf"^\.\. auto\w+:: magfold_env\.{name}$", told(), re.MULTILINE)


def test_every_wrapper_is_in_the_reference() -> None:
    for module in iter_modules(wrappers.__path__, f"{wrappers.__name__}."):
        for name, each in vars(import_module(module.name)).items():
            own = isinstance(each, type) and each.__module__ == module.name and name[0] != "_"
            if own and issubclass(each, (Wrapper, VectorWrapper)):
                assert f".. autoclass:: {module.name}.{name}\n" in told()


@pytest.mark.slow
def test_the_builders_notebook_runs_without_torch(tmp_path: Path) -> None:
    pytest.importorskip("IPython")
    pytest.importorskip("matplotlib.figure")
    page = (DOCS / "tutorials" / "build-your-own.md").read_text("utf-8")
    cells = re.findall(r"^```{code-cell} python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    code = "\n".join([*cells, "import sys; assert 'torch' not in sys.modules"])
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    assert (tmp_path / "sheet.png").stat().st_size > 0
