"""Errors a user can cause, and the words they are told in."""

import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import NamedTuple

from pydantic import BaseModel, ValidationError


class Problem(NamedTuple):
    """One wrong entry: its dotted key, the value given and what is allowed."""

    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        subject = f"{self.key}: " if self.key else ""
        return f"{subject}{self.value!r} is not allowed; {self.allowed}"


class SceneError(ValueError):
    """A scene that cannot be used: one line per problem, each naming key, value and remedy.

    Parameters
    ----------
    problems
        The wrong entries, or a single sentence where no entry is to blame (a missing file).
    source
        Where the scene came from, put before every line; empty for scenes made in code.
    """

    def __init__(self, problems: Iterable[Problem] | str, source: str = "") -> None:
        self.problems = () if isinstance(problems, str) else tuple(problems)
        self.lines = (problems,) if isinstance(problems, str) else tuple(map(str, self.problems))
        self.source = source
        prefix = f"{source}: " if source else ""
        super().__init__("\n".join(prefix + line for line in self.lines))


def unless_one_of(key: str, value: object, allowed: Iterable[object]) -> list[Problem]:
    """Return the problem with a value that is not one of those allowed."""
    choices = list(allowed)
    if value in choices:
        return []
    return [Problem(key, value, f"must be one of {', '.join(map(str, choices))}")]


def unless_at_least(key: str, value: float, least: float) -> list[Problem]:
    """Return the problem with a number that is below the least allowed, or none at all."""
    return [] if value >= least else [Problem(key, value, f"must be at least {least}")]


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the question whether the most similar of some names was meant, "; did you mean …?".

    Capitals do not count; empty if none is similar.
    """
    known = {each.casefold(): each for each in names}
    found = get_close_matches(name.casefold(), known, n=1)
    return f"; did you mean {known[found[0]]}?" if found else ""


def refuse(problems: Sequence[Problem]) -> None:
    """Raise a `SceneError` if there are problems."""
    if problems:
        raise SceneError(problems)


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Translate pydantic's report on a model, the outermost one, into problems with dotted keys."""
    problems: list[Problem] = []
    for entry in error.errors(include_url=False):
        key = dotted(entry["loc"])
        context = entry.get("ctx", {})
        cause = context.get("error")
        if isinstance(cause, SceneError):
            problems += [p._replace(key=_join(key, p.key)) for p in cause.problems]
        elif entry["type"] == "extra_forbidden":
            known = ", ".join(model.model_fields)
            problems.append(Problem(key, entry["input"], f"unknown key, must be one of {known}"))
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

    Parts in angle brackets are the tags of a union's branches, not keys, and are left out.
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
