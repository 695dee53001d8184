"""How the site documents pydantic models: their keys, allowed values and defaults."""

from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer

PLAIN = {float: "number", int: "whole number", str: "text", bool: "true or false"}
SIGNS = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}


def is_model(found: object) -> bool:
    """Return whether an object is a pydantic model other than `BaseModel` itself."""
    return isinstance(found, type) and issubclass(found, BaseModel) and found is not BaseModel


def fields(model: type[BaseModel]) -> Iterator[str]:
    """Yield the lines of reStructuredText that document each key as an attribute."""
    for name, field in model.model_fields.items():
        yield f".. py:attribute:: {name}"
        yield f"   :type: {_limited(_told(field.annotation), field.metadata)}"
        if not field.is_required():
            default = field.get_default(call_default_factory=True)
            own = isinstance(default, BaseModel)
            yield f"   :value: {f'{type(default).__name__}()' if own else repr(default)}"
        yield ""
        yield from (f"   {line}" for line in _docstring(model, name))
        yield ""


def _docstring(model: type[BaseModel], name: str) -> list[str]:
    for each in model.__mro__:
        found = ModuleAnalyzer.for_module(each.__module__).find_attr_docs()
        if (each.__qualname__, name) in found:
            return found[each.__qualname__, name]
    return []


def _told(kind: Any) -> str:
    """Return a description of a type."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _limited(_told(inner[0]), inner[1:])
    if origin in {Union, UnionType}:
        words = dict.fromkeys(_told(each) for each in inner if each is not NoneType)
        return " or ".join([*words, *(["None"] if NoneType in inner else [])])
    if origin is Literal:
        return " or ".join(map(repr, inner))
    if origin is tuple:
        if inner[-1] is Ellipsis:
            return f"list of {_told(inner[0])}"
        return f"({', '.join(map(_told, inner))})"
    return PLAIN.get(kind) or getattr(kind, "__name__", str(kind))


def _limited(told: str, metadata: Any) -> str:
    """Return a type's description with the limits from pydantic's metadata."""
    limits = [
        f"{sign} {value:.6g}"
        for each in metadata
        for entry in (each, *getattr(each, "metadata", ()))
        for key, sign in SIGNS.items()
        if (value := getattr(entry, key, None)) is not None
    ]
    return ", ".join([told, *dict.fromkeys(limits)])


def _without_fields(
    app: Sphinx, kind: str, name: str, found: Any, skip: bool, options: Any
) -> bool | None:
    """Omit the members that `fields` documents."""
    return True if name == "model_config" or name in _FIELDS else None


def _with_fields(
    app: Sphinx, kind: str, name: str, found: Any, options: Any, lines: list[str]
) -> None:
    if kind == "class":
        _FIELDS.clear()
    if is_model(found):
        _FIELDS.update(found.model_fields)
        lines += ["", *fields(found)]


_FIELDS: set[str] = set()
"""Keys of the model that is being documented."""


def setup(app: Sphinx) -> None:
    """Connect the handlers that document models."""
    app.setup_extension("sphinx.ext.napoleon")  # its handler must run first
    app.connect("autodoc-process-docstring", _with_fields)
    app.connect("autodoc-skip-member", _without_fields)
