"""The site: what is public is told, and what it shows runs."""

import ast
import inspect
import re
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest
from gymnasium import Wrapper
from gymnasium.vector import VectorWrapper

import magfold_env as mf
from magfold_env.envs import wrappers
from magfold_env.envs.tasks.feed_tasks import FeedOptions
from magfold_env.envs.tasks.world import ChainOptions, FoldOptions
from tests.command_line import run

DOCS = Path(__file__).parents[1] / "docs"
README = DOCS.parent / "README.md"


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


def words_of(options: type) -> dict[str, str]:
    """Return what is told of each option, as the pages of environments show it."""
    (body,) = (each.body for each in ast.parse(inspect.getsource(options)).body)  # pyright: ignore[reportAttributeAccessIssue]
    return {
        ast.unparse(key.target): ast.unparse(words)
        for key, words in pairwise(body)
        if isinstance(key, ast.AnnAssign)
    }


@pytest.mark.parametrize("kind", [ChainOptions, FoldOptions, FeedOptions])
def test_what_may_be_chosen_for_an_option_is_told(kind: type) -> None:
    hints = get_type_hints(kind)
    for name, told in words_of(kind).items():
        if get_origin(hints[name]) is Literal:
            for value in get_args(hints[name]):
                assert f"``{value}``" in told, name


def test_every_page_is_in_a_table_of_contents() -> None:
    listed: set[Path] = set()
    for page in DOCS.rglob("*.md"):
        for table in re.findall(r"```{toctree}\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            names = re.findall(r"^([a-z/-]+)$", table, re.MULTILINE)
            listed |= {page.parent / f"{name}.md" for name in names}
    assert listed == {*DOCS.rglob("*.md")} - {DOCS / "index.md"}


@pytest.mark.slow
def test_the_lines_of_python_in_the_readme_run(capsys: pytest.CaptureFixture[str]) -> None:
    (snippet,) = re.findall(r"```python\n(.*?)```", README.read_text("utf-8"), re.DOTALL)
    space: dict[str, Any] = {}
    exec(snippet, space)
    assert "folded LRLLL -0.01138" in capsys.readouterr().out
    assert space["observation"] in space["env"].observation_space


def test_the_readme_is_short() -> None:
    assert 500 <= len(README.read_text("utf-8").split()) <= 720


def test_the_scene_that_is_written_at_the_start_folds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (DOCS / "start.md").read_text("utf-8")
    (scene,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(scene, "utf-8")
    block = next(
        each for each in re.findall(r"```bash\n(.*?)```", page, re.DOTALL) if "mine" in each
    )
    commands = [line.partition("#")[0].split() for line in block.splitlines()]
    assert len(commands) == 3
    for _, *words in commands:
        few = ("--out", "few") if words[0] == "ensemble" else ()
        result = run(*(word.replace("200", "5") for word in words), *few)
        assert result.exit_code == 0, result.stderr
    assert Path("mine.html").is_file()
    assert Path("mine.pdf").is_file()
