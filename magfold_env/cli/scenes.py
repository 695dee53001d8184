"""`magfold scenes`: the shipped scenes and all keys of a scene."""

import json
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, NamedTuple

import typer
from rich.markup import escape

from magfold_env.cli import options
from magfold_env.scene import Scene, errors, load_scene, scene_names
from magfold_env.scene.base import FrozenModel

Schema = Mapping[str, Any]

_LIMITS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
_PLAIN = {
    "number": ("number", "numbers"),
    "integer": ("integer", "integers"),
    "string": ("text", "texts"),
    "boolean": ("true or false", "truth values"),
    "null": ("null", "nulls"),
}
_PAPER = """\
To reproduce the paper, use paper/alternative-k, which meets
20 of 23 statements of its text. paper/sequence-k has the paper's
magnets and friction and a slow feed, and meets 13. In -strong, magnets
are stronger on a smoother floor. -literal is the paper's own model."""
_NULL = "`null` in a file is `None` in Python."


class Key(NamedTuple):
    """The description of one key of a scene."""

    key: str
    allowed: str
    unit: str
    default: str
    meaning: str


def scenes(
    *,
    keys: Annotated[bool, typer.Option("--keys", help="List all keys of a scene instead.")] = False,
) -> None:
    """List the shipped scenes."""
    if keys:
        table = options.table("Keys of a scene", dict.fromkeys(Key._fields, False), _NULL)
        table.columns[0].no_wrap = True
        for key in scene_keys():
            table.add_row(*map(escape, key))
        options.wide_console().print(table)
        return
    columns = {"name": False, "n": True}
    columns |= dict.fromkeys(("mount", "magnets", "solver", "sequence"), False)
    table = options.table("Shipped scenes", columns, _PAPER)
    for name in scene_names():
        scene = load_scene(name)
        magnets = "none" if scene.magnets is None else scene.magnets.model
        cells = (name, str(scene.n), scene.mount, magnets, scene.solver.method)
        table.add_row(*cells, " ".join(scene.sequence))
    options.show(table)


def scene_keys() -> Iterator[Key]:
    """Yield all keys of a scene; the keys of a group follow the group."""
    schema = Scene.model_json_schema()
    yield from _keys(schema, schema["$defs"], "")


def _keys(group: Schema, groups: Mapping[str, Schema], before: str) -> Iterator[Key]:
    (kind,) = (each for each in FrozenModel.__subclasses__() if each.__name__ == group["title"])
    required, meanings = group.get("required", ()), errors.meanings(kind)
    for name, entry in group["properties"].items():
        told = meanings[name]
        units = errors.UNIT.findall(told)
        if len(units) == 1:
            told = told.replace(f" [{units[0]}]", "")
        default = "must be given" if name in required else _written(entry["default"])
        yield Key(before + name, _allowed(entry), ", ".join(units), default, told)
        many = "[]" if entry.get("type") == "array" else ""
        for each in _groups(entry):
            yield from _keys(groups[each], groups, f"{before}{name}{many}.")


def _groups(entry: Schema) -> Iterator[str]:
    """Yield the names of the groups that a key may contain."""
    if "$ref" in entry:
        yield entry["$ref"].rpartition("/")[2]
    for each in (*_choices(entry), *filter(None, [entry.get("items")])):
        yield from _groups(each)


def _choices(entry: Schema) -> list[Schema]:
    """Return the alternative schemas; pydantic up to 2.9 writes a single one as ``allOf``."""
    return [each for name in ("anyOf", "oneOf", "allOf") for each in entry.get(name, ())]


def _written(value: object) -> str:
    """Return a value as YAML text; empty for a group, because its keys have their own values."""
    if isinstance(value, dict):
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    return value if isinstance(value, str) else json.dumps(value)


def _allowed(entry: Schema, many: bool = False) -> str:
    """Return a description of what a JSON schema allows, in the plural if ``many``."""
    if "$ref" in entry:
        return "groups of the keys below" if many else "the keys below"
    if choices := _choices(entry):
        return ", or ".join(_allowed(each) for each in choices)
    if "const" in entry or "enum" in entry:
        return ", ".join(entry.get("enum", [entry.get("const")]))
    if entry["type"] == "array":
        return _list(entry, many)
    limits = " and ".join(
        f"{sign} {_written(entry[name])}" for name, sign in _LIMITS.items() if name in entry
    )
    return f"{_PLAIN[entry['type']][many]} {limits}".rstrip()


def _list(entry: Schema, many: bool) -> str:
    if inner := entry.get("prefixItems"):
        of = _allowed(inner[0], many=True)
        if not many and all(each == inner[0] for each in inner):
            return f"{len(inner)} {of}"
        return f"{'pairs' if many else 'pair'} ({', '.join(map(_allowed, inner))})"
    of = _allowed(entry["items"], many=True)
    least, most = entry.get("minItems"), entry.get("maxItems")
    if least is not None:
        return f"rows of {least} {of}" if many else f"{least} {of}"
    return f"list of {of}" if most is None else f"list of up to {most} {of}"
