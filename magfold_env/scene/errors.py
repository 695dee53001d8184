"""User errors and their messages."""

import re
import sys
from collections.abc import Hashable, Iterable, Sequence
from contextlib import suppress
from difflib import get_close_matches
from numbers import Integral, Real
from typing import NamedTuple, TypeGuard

from pydantic import BaseModel, ValidationError

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
    """Return a value as messages show it: on one line, without the middle of a long one."""
    with suppress(Exception):  # of a foreign class, or an integer of more than 4300 digits
        return shortened(re.sub(r"\n\s*", " ", repr(value)))  # arrays are shown in lines
    return object.__repr__(value)


def shortened(text: str, most: int = 160) -> str:
    """Return a text without the middle if it is much longer than ``most`` characters."""
    half = most // 2
    return text if len(text) <= most else f"{text[:half]} … {text[-half:]}"


class SceneError(ValueError):
    """A scene that cannot be used: one line per problem, each naming key, value and remedy.

    Parameters
    ----------
    problems
        The wrong entries, or a single sentence if no entry is wrong (such as a missing file).
    source
        Origin of the scene, which begins every line; empty for scenes made in code.
    """

    def __init__(self, problems: Iterable[Problem] | str, source: str = "") -> None:
        self.problems = () if isinstance(problems, str) else tuple(problems)
        self.lines = (problems,) if isinstance(problems, str) else tuple(map(str, self.problems))
        self.source = source
        prefix = f"{source}: " if source else ""
        rest = self.lines[MOST_TOLD:] and [f"and {len(self.lines) - MOST_TOLD} more"]
        super().__init__("\n".join(prefix + line for line in [*self.lines[:MOST_TOLD], *rest]))


def unless_one_of(key: str, value: object, allowed: Iterable[object]) -> list[Problem]:
    """Return the problem with a value that is not one of the allowed ones."""
    choices = list(allowed)
    # Membership of an array in a list is undefined.
    if isinstance(value, Hashable) and value in choices:
        return []
    return [Problem(key, value, f"must be one of {', '.join(map(str, choices))}")]


def unless_a(
    key: str, value: object, kinds: type | tuple[type, ...], allowed: str
) -> list[Problem]:
    """Return the problem with a value of the wrong type; ``allowed`` describes the right ones."""
    return [] if isinstance(value, kinds) else [Problem(key, value, f"must be {allowed}")]


def unless_function(key: str, value: object) -> list[Problem]:
    """Return the problem with a value that is neither None nor callable."""
    return [] if value is None or callable(value) else [Problem(key, value, "must be a function")]


def unless_whole(key: str, value: object, least: int, most: int | None = None) -> list[Problem]:
    """Return the problem with a value that is not a whole number within limits."""
    kind = "a whole number, "
    if isinstance(value, Integral) and is_number(value):
        if value >= least and (most is None or value <= most):
            return []
        kind = ""
    span = f"at least {least}" if most is None else f"from {least} to {most}"
    return [Problem(key, value, f"must be {kind}{span}")]


def unless_positive(key: str, value: object, most: float = sys.float_info.max) -> list[Problem]:
    """Return the problem with a value that is not a number above 0 within limits."""
    kind = "a number, "
    if is_number(value):
        if 0.0 < value <= most:
            return []
        kind = ""
    end = "finite" if most == sys.float_info.max else f"at most {most:.12g}"
    return [Problem(key, value, f"must be {kind}greater than 0 and {end}")]


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number of Python or NumPy; bools are not."""
    return not isinstance(value, bool) and isinstance(value, Real)


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the hint "; did you mean …?" with the most similar of some names.

    The comparison ignores case; the hint is empty if no name is similar.
    """
    known = {each.casefold(): each for each in names}
    found = get_close_matches(name.casefold(), known, n=1)
    return f"; did you mean {known[found[0]]}?" if found else ""


def refuse(problems: Sequence[Problem]) -> None:
    """Raise a `SceneError` if there are problems."""
    if problems:
        raise SceneError(problems)


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Convert pydantic's report on an outermost model to problems with dotted keys."""
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
        else:
            allowed = str(cause) if cause is not None else entry["msg"]
            allowed = re.sub(r"^(Input|Tuple) should|(?<=.) after validation", _reword, allowed)
            problems.append(Problem(key, entry["input"], allowed))
    return problems


def dotted(location: Sequence[str | int]) -> str:
    """Write a location as a key: ('casing', 'mass', 2) -> 'casing.mass[2]'.

    Parts in angle brackets are tags of the branches of a union, not keys, and are omitted.
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
