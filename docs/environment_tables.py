"""Generate the site's tables of spaces, observation entries, options and admission results.

`conf.py` calls `written`, which puts a table below each comment such as
``<!-- spec MagFold/Lumen-v0 -->``. Sizes and ranges come from the code, their meanings from its
docstrings, and results from the files in ``agents/scores``.
``python docs/environment_tables.py docs/environments/lumen.md`` prints a page with its tables.
"""

import inspect
import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

import gymnasium
from sphinx.pycode import ModuleAnalyzer

from magfold_env.envs.camera_track import FeedTrackEnv
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.tasks import setup
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.unknown_floor import UnknownFloorEnv

DOCS = Path(__file__).parent
SCORES = DOCS.parent / "agents" / "scores"
BLOCK = re.compile(r"(?m)^<!-- (\w+)(?: (MagFold/\S+))? -->$(?:\n(?:(?!<!--).*\n)*<!-- end -->$)?")
"""The place of a table, and the table up to ``<!-- end -->`` if the page contains it."""

# In the order of the rows on the page.
CONTESTANTS = {
    "random": "random actions",
    "always forward": "always forward at the highest speed",
    "baseline": "baseline method, whose score is b",
    "open loop": "best of 1,000 open loops for each task",
    "trained blind": "policy of the same learner, trained blind",
    "frozen": "policy, frozen: it repeats its actions from one episode",
    "trained": "policy, most probable actions",
    "trained, drawn": "policy, randomly drawn actions",
    "oracle": "oracle, which knows everything except the start and the noise",
}

STANDING = {
    "open loop": "open loop",
    "trained blind": "trained blind",
    "frozen": "frozen",
    "trained": "policy",
    "oracle": "oracle",
}

LIKE = {FeedTrackEnv: UnknownFloorEnv, FoldEnv: TubeFeedEnv}
"""The class whose docstring describes what the docstrings of a kind of environment omit."""


class Entries:
    """Groups of entries of an observation, read from the tables in docstrings.

    Parameters
    ----------
    classes : sequence of type
        Environments. If several describe a group, the first description counts.
    """

    def __init__(self, *classes: type) -> None:
        self.described: dict[str, tuple[str, str, str]] = {}
        """Number of entries, meaning and range of each group."""
        for each in classes:
            for group, *rest in _rows(inspect.getdoc(each) or ""):
                self.described.setdefault(group, (rest[0], rest[1], rest[2]))

    def count(self, group: str, **names: int) -> int:
        """Return the number of entries of a group that a formula such as ``3 (n − 1)`` gives."""
        formula = re.sub(r"(?<=\d) (?=[a-z(])", "*", self.described[group][0].replace("−", "-"))
        return int(eval(formula, {}, names))  # of this repository's own docstrings


def classes_of(env: Any) -> list[type]:
    """Return the classes whose docstrings describe the entries of an environment's observations."""
    return [*type(env).__mro__, *(base for kind, base in LIKE.items() if isinstance(env, kind))]


def _rows(docstring: str) -> list[list[str]]:
    """Return the rows of a docstring's simple tables of entries."""
    found: list[list[str]] = []
    for border, body in re.findall(
        r"(?ms)^(=+ =[ =]*)\ngroup .*?\n=+ =[ =]*\n(.*?)\n=+ =", docstring
    ):
        starts = [match.start() for match in re.finditer("=+", border)]
        for line in body.splitlines():
            cells = [line[i:j].strip() for i, j in zip(starts, [*starts[1:], None], strict=True)]
            if cells[0]:
                found.append(cells)
            else:  # the line continues the row before
                found[-1] = [f"{a} {b}".strip() for a, b in zip(found[-1], cells, strict=True)]
    return found


def options_of(env: Any) -> Iterator[tuple[str, str]]:
    """Yield the options of an environment, including shared ones, and their meanings."""
    hint = get_type_hints(type(env).__init__, include_extras=True)["options"]
    (kind,) = get_args(hint)
    values = {
        name: " ".join(lines)
        for module in (setup.__name__, kind.__module__)
        for (owner, name), lines in ModuleAnalyzer.for_module(module).find_attr_docs().items()
        if owner.endswith("Options")
    }
    for name in kind.__annotations__:
        yield name, values[name].strip()


def table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table."""
    yield f"| {' | '.join(head)} |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield f"| {' | '.join(row)} |"


def spec(env_id: str) -> Iterator[str]:
    """Yield the lines on how to make an environment, and on its spaces and scene."""
    env: Any = gymnasium.make(env_id).unwrapped
    yield from table(("", ""), _facts(env_id, env))


def _facts(env_id: str, env: Any) -> Iterator[tuple[str, str]]:
    name, _ = env.setup.option
    tasks = f"{len(set(env.setup.words))} words"
    fixed = repr(env.targets[0]) if name == "target" else "0"
    if name == "task":
        tasks = f"{len(env.tasks)}, from the list `{env.default_tasks}`"
    yield "make", f'`gymnasium.make("{env_id}")`, `gymnasium.make_vec("{env_id}", num_envs=64)`'
    yield "actions", f"`{env.action_space}`"
    yield "observations", f"`{env.observation_space}`".replace("\n", " ")
    yield name + "s", tasks
    yield f"choose a {name}", f'`reset(options={{"{name}": {fixed}}})`'
    yield "scene", f"`{env.default_scene}`, {env.scene.n} components"
    yield "render modes", ", ".join(f"`{mode}`" for mode in env.metadata["render_modes"])
    yield "class", f"`{str(gymnasium.spec(env_id).entry_point).replace(':', '.')}`"


def observation(env_id: str) -> Iterator[str]:
    """Yield the lines on the entries of an environment's observation.

    Raises
    ------
    ValueError
        If no docstring describes an entry.
    """
    env: Any = gymnasium.make(env_id).unwrapped
    yield from table(("entries", "group", "meaning", "range"), _groups(env))
    yield ""
    yield "Entries marked * are squashed by x / (1 + |x|), so no value is clipped."


def _groups(env: Any) -> Iterator[tuple[str, ...]]:
    entries = Entries(*classes_of(env))
    names = {"n": env.layout.n, "parts": getattr(env.setup.actions, "parts", 0)}
    for group, place in env.layout.slices.items():
        count = place.stop - place.start
        if group not in entries.described or entries.count(group, **names) != count:
            raise ValueError(f"no docstring describes {count} entries {group!r}")
        where = f"{place.start}" if count == 1 else f"{place.start}–{place.stop - 1}"
        _, meaning, bounds = entries.described[group]
        yield where, f"`{group}`", meaning, bounds.replace("*", "\\*")


def options(env_id: str) -> Iterator[str]:
    """Yield the lines on an environment's options."""
    env: Any = gymnasium.make(env_id).unwrapped
    yield from table(("option", "meaning"), ((f"`{name}`", text) for name, text in options_of(env)))


def admission(env_id: str) -> Iterator[str]:
    """Yield the lines on the results of all players and on the admission rule."""
    name = env_id.split("/")[1]
    found = json.loads((SCORES / f"admission-{name}.json").read_text("utf-8"))
    figures = found["figures"]
    head = (f"{figures['episodes']:,} episodes", "success, %", "score", "normalised")
    yield from table(head, _contestants(found))
    yield ""
    for each in figures["rule"]:
        holds = "" if each["holds"] else ", **not met**"
        yield f"- {each['line']}; measured difference: {_points(each['measured'])}{holds}"
    yield ""
    room = _points(figures["headroom"])
    yield f"Headroom (oracle minus policy): {room}; **{figures['verdict']}**."
    yield "[Admission](../evaluation.md#admission) explains the rows. The command was:"
    yield ""
    yield f"```text\n{found['provenance']['command']}\n```"


def _contestants(found: Any) -> Iterator[tuple[str, ...]]:
    for key, name in CONTESTANTS.items():
        row, seeds = found["rows"][key], len(found["rows"][key].get("files", ()))
        label = f"{name}{f', {seeds} seeds' if seeds > 1 else ''}"
        yield label, _share(row), f"{row['score']:.3f}", f"{row['figures']['normalised']:.2f}"


def standing(_: None) -> Iterator[str]:
    """Yield the lines on where all tracks stand."""
    yield from table(("track", *STANDING.values(), "headroom, points", "verdict"), _standing())


def _standing() -> Iterator[tuple[str, ...]]:
    for path in sorted(SCORES.glob("admission-*.json")):
        found = json.loads(path.read_text("utf-8"))
        name = found["id"].split("/")[1].removesuffix("-v0")
        page = re.sub("(?<=[a-z])(?=[A-Z])", "-", name).lower()
        shares = (_share(found["rows"][key]) for key in STANDING)
        figures = found["figures"]
        room = f"{100 * figures['headroom'][0]:.1f}".replace("-", "−")
        yield f"[`{name}`](environments/{page}.md)", *shares, room, figures["verdict"]


def _share(row: Any) -> str:
    value, low, high = (f"{100 * each:.1f}" for each in row["success"])
    return f"{value} ({low}–{high})"


def _points(measured: Sequence[float]) -> str:
    value, low, high = (f"{100 * each:.1f}".replace("-", "−") for each in measured)
    return f"{value} points ({low} to {high})"


BLOCKS: dict[str, Callable[[Any], Iterator[str]]] = {
    each.__name__: each for each in (spec, observation, options, admission, standing)
}


def written(page: str) -> str:
    """Return the text of a page, with its tables filled in."""

    def block(found: re.Match[str]) -> str:
        name, env_id = found.groups()
        opened = found[0].partition("\n")[0]
        lines = "\n".join(BLOCKS[name](env_id))
        return f"{opened}\n\n{lines}\n\n<!-- end -->"

    return BLOCK.sub(block, page)


if __name__ == "__main__":
    for page in sys.argv[1:]:
        sys.stdout.write(written(Path(page).read_text("utf-8")))
