"""Read and write scenes as YAML files. Shipped scenes have names, and other scenes have paths."""

import os
import re
from pathlib import Path
from typing import Any, TypeVar, cast

import yaml

from magfold_env.files import configs_dir, read_text, write_text
from magfold_env.scene.base import FrozenModel
from magfold_env.scene.errors import SceneError, nearest, quoted, refuse, shortened, unless_a
from magfold_env.scene.scene import Scene, unless_a_scene

ModelType = TypeVar("ModelType", bound=FrozenModel)

_SUFFIXES = (".yaml", ".yml")

MOST_BYTES = 2 << 20
"""Largest size of a YAML file [bytes]; such a file takes about four seconds to read."""


_NUMBERS = {
    "tag:yaml.org,2002:int": r"[-+]?(?:0|[1-9][0-9_]*)",
    "tag:yaml.org,2002:float": r"[-+]?(?:[0-9][0-9_]*(?:\.[0-9_]*)?|\.[0-9][0-9_]*)"
    r"(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)",
}


class _Loader(yaml.SafeLoader):
    """A safe YAML loader that reads numbers as decimal, and refuses aliases and repeated keys.

    PyYAML follows YAML 1.1, which reads 1e-3 as text, 1:30 as 90 and 010 as 8. With aliases of
    aliases, a file of one kilobyte could fill any memory. Keys must be text.
    """

    yaml_implicit_resolvers = {  # noqa: RUF012 - as PyYAML has it
        first: [each for each in found if each[0] not in _NUMBERS]
        for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        own = cast("Any", self)
        if own.check_event(yaml.AliasEvent):
            event = own.peek_event()
            alias = shortened(event.anchor)
            told = f"the alias *{alias} is not allowed; must be what it stands for, in full"
            raise yaml.MarkedYAMLError(problem=told, problem_mark=event.start_mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key_node, _ in node.value:
            key = cast("Any", self.construct_object(key_node, deep=True))  # pyright: ignore[reportUnknownMemberType]
            if not isinstance(key, str) or key in seen:
                wrong = "is given twice" if isinstance(key, str) else "is not text"
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {quoted(key)} {wrong}", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


for _tag, _form in _NUMBERS.items():
    _pattern = re.compile(f"(?:{_form})$")
    cast("Any", _Loader).add_implicit_resolver(_tag, _pattern, list("-+.0123456789"))


def scene_names() -> list[str]:
    """Return the names of the shipped scenes, sorted."""
    return shipped_names("scenes")


def load_scene(name_or_path: str | Path) -> Scene:
    """Read a scene.

    Parameters
    ----------
    name_or_path
        The name of a shipped scene, such as "paper/sequence-3", or the path of a YAML file.

    Raises
    ------
    SceneError
        If the scene or file does not exist, or is not valid.
    """
    return read_named(name_or_path, "scenes", scene_names(), Scene)


def save_scene(scene: Scene, path: str | Path, comment: str = "") -> None:
    """Write all fields of a scene as YAML; `load_scene` reads an equal scene from the file.

    Parameters
    ----------
    scene
        The scene to write.
    path
        Path of the file.
    comment
        Text that is written before the scene, as comment lines.

    Raises
    ------
    SceneError
        If `scene` is not a `Scene`.
    """
    refuse([*unless_a_scene(scene), *unless_a("comment", comment, str, "text")])
    data = scene.model_dump(mode="json")
    write_commented(path, yaml.safe_dump(data, sort_keys=False, default_flow_style=None), comment)


def write_commented(path: str | Path, text: str, comment: str) -> None:
    """Write YAML text below the lines of a comment."""
    head = "".join(f"# {line}\n" for line in comment.splitlines())
    write_text(path, head + text)


def shipped_names(folder: str) -> list[str]:
    """Return the sorted names of the shipped settings in a folder."""
    root = configs_dir() / folder
    return sorted(
        path.relative_to(root).with_suffix("").as_posix() for path in root.rglob("*.yaml")
    )


def read_named(
    name_or_path: str | Path, folder: str, names: list[str], kind: type[ModelType]
) -> ModelType:
    """Read settings of the type ``kind``: shipped ones in a folder by name, others by path."""
    what = kind.__name__.lower()
    refuse(unless_a(what, name_or_path, (str, Path), f"the name of a {what}, or a file's path"))
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and name_or_path in names:
        path = configs_dir() / folder / f"{name_or_path}.yaml"
    if not os.path.isfile(path):  # which takes names that no file can have
        named = isinstance(name_or_path, str) and path.suffix not in _SUFFIXES
        listed = "`magfold scenes` lists them" if kind is Scene else f"shipped: {', '.join(names)}"
        shown = f"no such {what}; {listed}" if named else "no such file"
        missing = f"must be a {what}'s name or file" if os.path.exists(path) else shown
        meant = nearest(str(name_or_path), names)
        raise SceneError(f"{quoted(str(name_or_path))[1:-1]}: {missing}{meant}")
    try:
        return kind(**read_mapping(path, what))
    except SceneError as error:
        if not error.problems:
            raise
        raise SceneError(error.problems, source=str(path)) from None


def read_mapping(path: Path, what: str) -> dict[str, Any]:
    """Return the keys and values in a YAML file, or raise a `SceneError`.

    ``what`` names the kind of content in messages, such as "scene".
    """
    try:
        data = parse_yaml(read_text(path, MOST_BYTES))
    except (OSError, ValueError) as error:
        told = str(error) if isinstance(error, SceneError) else f"cannot be read: {error}"
        raise SceneError(told, source=str(path)) from None
    if not isinstance(data, dict):
        message = f"{quoted(data)} is not a {what}; must be a mapping of keys"
        raise SceneError(message, source=str(path))
    return cast("dict[str, Any]", data)


def parse_yaml(text: str) -> object:
    """Parse YAML, or raise a `SceneError`. The package parses all YAML with this function."""
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark, told = error.problem_mark or error.context_mark, shortened(error.problem or "")
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise SceneError(where + told) from None
    except yaml.YAMLError as error:
        raise SceneError(f"not YAML: {shortened(' '.join(str(error).split()))}") from None
    except (ValueError, RecursionError) as error:
        raise SceneError(f"cannot be read: {error}") from None
