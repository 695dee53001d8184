"""Settings as they lie in YAML files, before they are checked."""

from pathlib import Path
from typing import Any

import yaml

from magfold_env.files import configs_dir


class SettingsError(ValueError):
    """Settings that cannot be used: one line per problem, each naming key, value and remedy."""


def find_config(path: str | Path, kind: str) -> Path:
    """Return the file at `path`, or the shipped one of that name in the folder `kind`.

    Raises
    ------
    SettingsError
        If there is neither.
    """
    folder = configs_dir() / kind
    for candidate in (Path(path), folder / path, folder / f"{path}.yaml"):
        if candidate.is_file():
            return candidate
    shipped = ", ".join(sorted(file.stem for file in folder.glob("*.yaml")))
    raise SettingsError(f"{path}: no such file; shipped settings: {shipped}")


def read_mapping(file: Path) -> dict[str, Any]:
    """Read a YAML file that holds keys and values.

    Raises
    ------
    SettingsError
        If it holds anything else.
    """
    try:
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        raise SettingsError(f"{file}: not YAML: {error}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise SettingsError(f"{file}: cannot be read: {error}") from None
    if not isinstance(content, dict):
        raise SettingsError(f"{file}: {content!r} is not allowed; must be a mapping of keys")
    return content


def parse_assignment(assignment: str) -> tuple[str, Any]:
    """Return the key and the value of ``key.key=value``; the value is YAML.

    Raises
    ------
    SettingsError
        If it is no such thing.
    """
    key, separator, text = assignment.partition("=")
    if not separator:
        raise SettingsError(f"{assignment!r} is not allowed; must be a key and a value, key=value")
    try:
        return key.strip(), yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise SettingsError(f"{assignment!r} is not allowed; not YAML: {error}") from None


def put(content: dict[str, Any], key: str, value: Any) -> None:
    """Put `value` where the dotted `key` belongs in `content`.

    Raises
    ------
    SettingsError
        If something else than a group of settings is in its way.
    """
    *groups, last = key.split(".")
    for depth, group in enumerate(groups):
        content = content.setdefault(group, {})
        if not isinstance(content, dict):
            outer = ".".join(groups[: depth + 1])
            raise SettingsError(f"{key}={value} is not allowed; {outer} is not a group of settings")
    content[last] = value
