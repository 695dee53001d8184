"""What a search chose, in a file that it goes on from after a kill."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from agents.evaluation.open_loop import OpenLoop
from magfold_env.files import write_text
from magfold_env.scene import Problem
from magfold_env.scene.errors import dotted

FORMAT = "magfold_env choices 1"


@dataclass(frozen=True)
class Chosen:
    """What a search chose for one target, and what speaks for it.

    Attributes
    ----------
    sequence, speeds
        See `OpenLoop`.
    calls : int
        Physics calls that the search made.
    successes, releases : int
        How many calls of this choice succeeded, and how many there were: a flattering share, since
        it was chosen for it.
    """

    sequence: tuple[str, ...]
    speeds: tuple[float, ...]
    calls: int
    successes: int
    releases: int

    @property
    def choice(self) -> OpenLoop:
        """The choice alone."""
        return OpenLoop(self.sequence, self.speeds)


class ChoiceFile:
    """Choices by target, written anew with every one that is added.

    Parameters
    ----------
    path : Path
        A JSON file; its folder is made if need be.
    key : mapping
        Everything that the choices depend on but their target, as values that JSON can hold.

    Raises
    ------
    ValueError
        If the file exists and is damaged, or was written with another key.
    """

    def __init__(self, path: Path, key: Mapping[str, Any]) -> None:
        self._path, self._key = path, json.loads(json.dumps(key))
        self._chosen: dict[str, Chosen] = {}
        if path.is_file():
            content = _read(path)
            for name, value in self._key.items():
                if (there := content["key"].get(name)) != value:
                    raise ValueError(
                        f"{path}: was written by another search, with {name} {there!r}; "
                        f"must be {value!r}, or give another file"
                    )
            self._chosen = _chosen_in(content, path)

    @property
    def chosen(self) -> Mapping[str, Chosen]:
        """What was chosen so far, by target."""
        return self._chosen

    def add(self, target: str, chosen: Chosen) -> None:
        """Add what was chosen for a target."""
        self._chosen[target] = chosen
        choices = {word: asdict(each) for word, each in self._chosen.items()}
        content: dict[str, Any] = {"format": FORMAT, "key": self._key, "choices": choices}
        content["checksum"] = _checksum(content)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_text(self._path, json.dumps(content, indent=1) + "\n")


def read_choices(path: Path) -> dict[str, OpenLoop]:
    """Return the choices in a file, by target.

    Raises
    ------
    ValueError
        If it is no such file, or damaged.
    """
    return {target: each.choice for target, each in _chosen_in(_read(path), path).items()}


def read_key(path: Path) -> dict[str, Any]:
    """Return what the choices in a file depend on.

    Raises
    ------
    ValueError
        If it is no such file, or damaged.
    """
    return _read(path)["key"]


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        checksum = content.pop("checksum")
        whole = content["format"] == FORMAT and checksum == _checksum(content)
        whole = whole and isinstance(content["key"], dict)
    except (OSError, ValueError, AttributeError, KeyError, TypeError, RecursionError):
        whole, content = False, {}
    if not whole:
        raise ValueError(f"{path}: holds no choices of agents.baselines, or is damaged")
    return content


def _chosen_in(content: Mapping[str, Any], path: Path) -> dict[str, Chosen]:
    try:
        return _CHOICES.validate_python(content.get("choices"))
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
        key = dotted(("choices", *wrong["loc"]))
        raise ValueError(f"{path}: {Problem(key, wrong['input'], wrong['msg'])}") from None


_CHOICES = TypeAdapter(dict[str, Chosen])


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
