"""Walk through README's doors as a new user would, timed: ``python -m tests.walks [DOOR …]``.

A walk begins in a fresh clone with no environment, no compiled kernels and an empty home. What it
types stands on the pages. The exit code is 1 if a command fails, or if the first result of one's
own comes later than five minutes after the installation.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from tests import snippets

LIMIT = 300.0
"""Latest first result of one's own, after the installation [s]."""

DOCS = snippets.ROOT / "docs"
tell = partial(print, flush=True)


class Step(NamedTuple):
    """What is typed at one go."""

    what: str
    shell: str
    own: bool = False
    """Whether it ends in a result that is the user's own."""


class Door(NamedTuple):
    """One way into the project."""

    installation: str
    steps: list[Step]


def shell_block(page: str, has: str) -> str:
    """Return the one block of a page that has such words."""
    (found,) = (b for b in snippets.blocks(DOCS / page, "bash") if has in b)
    return found


def cells(tutorial: str, count: int, without: Sequence[int] = ()) -> str:
    """Return the first cells of a tutorial, but for those that draw, as they are typed."""
    page = DOCS / "tutorials" / f"{tutorial}.md"
    found = snippets.blocks(page, r"\{code-cell\} python")[:count]
    assert len(found) == count
    typed_cells = (cell for k, cell in enumerate(found) if k not in without)
    return "python - <<'END'\n" + "".join(typed_cells) + "END\n"


def doors() -> dict[str, Door]:
    """Return the walks, made of what the pages say today."""
    quickstart = shell_block("start.md", "agents.quickstart").strip()
    environment, install, train = quickstart.split(" && ")
    only_render = install.replace(".[agents,render]", ".[render]")
    (scene,) = snippets.blocks(DOCS / "start.md", "yaml")
    written = f"cat > mine.yaml <<'END'\n{scene}END\n"
    first = shell_block("start.md", "source .venv")
    mine = shell_block("start.md", "mine.yaml").strip().splitlines()
    evaluate = "python -m agents.evaluate mine=runs/quickstart/policy.safetensors --draws 4"
    return {
        "builder": Door(
            f"{environment} && {only_render}",
            [
                Step("the first fold, on a page", first),
                Step("a scene of one's own: its fold, a sheet", written + mine[0], own=True),
                Step("what energy predicts of it", mine[1]),
                Step("how likely each fold of it is", mine[2]),
                Step("magnets for a shape, and their sheet", shell_block("design.md", "LRLLL")),
                Step("what a fold withstands", shell_block("holding.md", "hold").splitlines()[0]),
            ],
        ),
        "trainer": Door(
            f"{environment} && {install}",
            [
                Step("train and compare", train, own=True),
                Step("that policy again, on other draws", evaluate),
                Step("an episode and a learner of one's own", cells("train-an-agent", 2)),
                Step("Stable-Baselines3 by its adapter", cells("train-an-agent", 3)),
            ],
        ),
        "reader": Door(
            f"{environment} && {only_render}",
            [
                Step("Table 1 in lines to be changed", cells("the-paper", 2), own=True),
                Step("steps of the paper's solver", cells("the-paper", 4, without=(2,))),
                Step(
                    "a table and a figure as a page", shell_block("paper.md", "15").splitlines()[2]
                ),
            ],
        ),
    }


def walk(name: str, door: Door) -> bool:
    """Go through a door; tell what each step took, and return whether all went well."""
    with tempfile.TemporaryDirectory(prefix="walk-") as folder:
        clone = Path(folder, "magfold_env")
        subprocess.run(["git", "clone", "-q", snippets.ROOT, clone], check=True)
        kept = {k: v for k, v in os.environ.items() if k.startswith(("LANG", "PIP_", "PYENV_"))}
        home = {"HOME": folder, "PATH": f"{clone}/.venv/bin:{os.environ['PATH']}"}
        begun = time.monotonic()
        if not typed(door.installation, clone, kept | home):
            return False
        installed = time.monotonic()
        tell(f"{name}: installed after {installed - begun:.0f} s")
        own = None
        for count, step in enumerate(door.steps, start=1):
            before = time.monotonic()
            if not typed(step.shell, clone, kept | home):
                return False
            now = time.monotonic()
            tell(
                f"{name}: {count}. {step.what}: {now - before:.0f} s, {now - installed:.0f} in all"
            )
            if step.own and own is None:
                own = now - installed
        assert own is not None
        tell(f"{name}: the first result of one's own after {own:.0f} s ({LIMIT:.0f} at most)")
        return own <= LIMIT


def typed(shell: str, where: Path, environment: dict[str, str]) -> bool:
    """Run what is typed; what it says is told only if it fails."""
    done = subprocess.run(
        ["bash", "-ec", shell],
        cwd=where,
        env=environment,
        text=True,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        tell(f"{shell}\n{done.stdout}\n{done.stderr}", file=sys.stderr)
    return done.returncode == 0


def main() -> None:
    """Walk through the doors that are named, or all."""
    walks = doors()
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0] if __doc__ else "")
    parser.add_argument("door", nargs="*", choices=[[], *walks])
    asked = parser.parse_args().door or list(walks)
    passed = [walk(name, walks[name]) for name in asked]
    sys.exit(not all(passed))


if __name__ == "__main__":
    main()
