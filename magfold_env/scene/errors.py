"""User errors and their messages."""

import ast
import inspect
import re
import sys
from collections.abc import Hashable, Iterable, Sequence
from contextlib import suppress
from difflib import get_close_matches
from functools import cache
from itertools import pairwise
from numbers import Integral, Real
from typing import NamedTuple, TypeGuard

from pydantic import BaseModel, ValidationError

UNIT = re.compile(r"\[(.+?)\]")  # in the docstring of a key
_KINDS = {"float_type": ("number", "number in "), "tuple_type": ("list", "list of numbers in ")}
MOST_TOLD = 20  # problems in a message


class Problem(NamedTuple):
    """One wrong entry: its dotted key, the given value and the allowed values."""

    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        subject = f"{shortened(self.key)}: " if self.key else ""
        return f"{subject}{quoted(self.value)} is not allowed; {self.allowed}"


def quoted(value: object) -> str:
    """Return a value as text for messages: on one line, and without its middle if it is long."""
    with suppress(Exception):  # of a foreign class, or an integer of more than 4300 digits
        return shortened(re.sub(r"\n\s*", " ", repr(value)))  # arrays are shown in lines
    return object.__repr__(value)


def shortened(text: str, most: int = 160) -> str:
    """Return a text, without its middle if it is longer than ``most`` characters."""
    half = most // 2
    return text if len(text) <= most else f"{text[:half]} … {text[-half:]}"


class SceneError(ValueError):
    """An error in a scene; each line of the message names a key, its value and what is allowed.

    Parameters
    ----------
    problems
        The wrong entries, or one sentence for any other error, such as a missing file.
    source
        Origin of the scene, which every line names first; empty for scenes made in code.
    """

    def __init__(self, problems: Iterable[Problem] | str, source: str = "") -> None:
        self.problems = () if isinstance(problems, str) else tuple(problems)
        self.lines = (problems,) if isinstance(problems, str) else tuple(map(str, self.problems))
        self.source = source
        prefix = f"{source}: " if source else ""
        rest = self.lines[MOST_TOLD:] and [f"and {len(self.lines) - MOST_TOLD} more"]
        super().__init__("\n".join(prefix + line for line in [*self.lines[:MOST_TOLD], *rest]))


def unless_one_of(key: str, value: object, allowed: Iterable[object]) -> list[Problem]:
    """Return the problem, if any, with a value that must be one of ``allowed``."""
    choices = list(allowed)
    # NumPy cannot compare an array with the choices.
    if isinstance(value, Hashable) and value in choices:
        return []
    return [Problem(key, value, f"must be one of {', '.join(map(str, choices))}")]


def unless_a(
    key: str, value: object, kinds: type | tuple[type, ...], allowed: str
) -> list[Problem]:
    """Return the problem, if any, with a value of the wrong type; ``allowed`` names ``kinds``."""
    return [] if isinstance(value, kinds) else [Problem(key, value, f"must be {allowed}")]


def unless_function(key: str, value: object) -> list[Problem]:
    """Return the problem, if any, with a value that must be None or callable."""
    return [] if value is None or callable(value) else [Problem(key, value, "must be a function")]


def unless_whole(key: str, value: object, least: int, most: int | None = None) -> list[Problem]:
    """Return the problem, if any, with a value that must be a whole number within limits."""
    kind = "a whole number, "
    if isinstance(value, Integral) and is_number(value):
        if value >= least and (most is None or value <= most):
            return []
        kind = ""
    span = f"at least {least}" if most is None else f"from {least} to {most}"
    return [Problem(key, value, f"must be {kind}{span}")]


def unless_positive(key: str, value: object, most: float = sys.float_info.max) -> list[Problem]:
    """Return the problem, if any, with a number that must be above 0 and at most ``most``."""
    kind = "a number, "
    if is_number(value):
        if 0.0 < value <= most:
            return []
        kind = ""
    end = "finite" if most == sys.float_info.max else f"at most {most:.12g}"
    return [Problem(key, value, f"must be {kind}greater than 0 and {end}")]


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number of Python or NumPy; a bool is not."""
    return not isinstance(value, bool) and isinstance(value, Real)


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the hint "; did you mean …?" with the name that is most similar to ``name``.

    The comparison ignores case. The hint is empty if no name is similar.
    """
    known = {each.casefold(): each for each in names}
    found = get_close_matches(name.casefold(), known, n=1)
    return f"; did you mean {known[found[0]]}?" if found else ""


def refuse(problems: Sequence[Problem]) -> None:
    """Raise a `SceneError` if there are problems."""
    if problems:
        raise SceneError(problems)


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Convert the errors that pydantic found in a ``model`` to problems with dotted keys."""
    problems: list[Problem] = []
    for entry in error.errors(include_url=False):
        key = dotted(entry["loc"])
        context = entry.get("ctx", {})
        cause = context.get("error")
        if isinstance(cause, SceneError):
            problems += [p._replace(key=_join(key, p.key)) for p in cause.problems]
        elif entry["type"] == "extra_forbidden":
            names = model.model_fields
            allowed = f"unknown key, must be one of {', '.join(names)}"
            meant = nearest(str(entry["loc"][-1]), names)
            problems.append(Problem(key, entry["input"], allowed + meant))
        elif entry["type"] == "missing" and isinstance(entry["loc"][-1], str):
            problems.append(Problem(key, None, "must be given"))
        elif entry["type"] == "missing":
            allowed = f"must have a value at {key}"
            problems.append(Problem(dotted(entry["loc"][:-1]), entry["input"], allowed))
        elif (kind := entry["type"]) in _KINDS:
            units = UNIT.findall(meanings(model).get(str(entry["loc"][0]), ""))
            if kind == "float_type" and len(units) > 1:  # in pairs
                units = [units[int(entry["loc"][-1])]]
            allowed = f"must be a {_KINDS[kind][bool(units)]}{' and '.join(units)}"
            problems.append(Problem(key, entry["input"], allowed))
        else:
            allowed = str(cause) if cause is not None else entry["msg"]
            allowed = re.sub(r"^(Input|Tuple) should|(?<=.) after validation", _reword, allowed)
            problems.append(Problem(key, entry["input"], allowed))
    return problems


@cache
def meanings(model: type[BaseModel]) -> dict[str, str]:
    """Return the docstring of each key of a group; empty if the group has no source file.

    Pydantic can read them too, but then every process that makes a scene spends a tenth of a
    second.
    """
    found: dict[str, str] = {}
    with suppress(KeyError, OSError, TypeError):  # such as that of a class in a notebook
        for group in ast.walk(ast.parse(inspect.getsource(sys.modules[model.__module__]))):
            if isinstance(group, ast.ClassDef) and group.name == model.__name__:
                for key, told in pairwise(group.body):
                    if isinstance(key, ast.AnnAssign) and isinstance(told, ast.Expr):
                        text = str(getattr(told.value, "value", ""))
                        found[ast.unparse(key.target)] = " ".join(text.split())
    return found


def dotted(location: Sequence[str | int]) -> str:
    """Write a location as a key: ('casing', 'mass', 2) -> 'casing.mass[2]'.

    Parts in angle brackets are omitted: they are not keys but tags of a union's branches.
    """
    key = ""
    for part in location:
        if isinstance(part, int):
            key += f"[{part}]"
        elif not part.startswith("<"):
            key = _join(key, part)
    return key


def _reword(match: re.Match[str]) -> str:
    return "must" if match.start() == 0 else ""


def _join(outer: str, inner: str) -> str:
    if not outer or not inner or inner.startswith("["):
        return outer + inner
    return f"{outer}.{inner}"
