"""Target suites: named lists of fold words in ``configs/suites``."""

from pathlib import Path

import yaml

from magfold_env.errors import SceneError
from magfold_env.files import configs_dir
from magfold_env.scene_parts import Part


class Suite(Part):
    """A list of targets for chains of one length."""

    components: int
    """Chain length."""
    targets: tuple[str, ...]
    """Fold words."""


def suite_names() -> list[str]:
    """Return the names of the shipped suites, sorted."""
    return sorted(path.stem for path in _folder().glob("*.yaml"))


def load_suite(name: str) -> Suite:
    """Read a shipped suite.

    Raises
    ------
    ValueError
        If there is none of this name.
    SceneError
        If its file is not a suite.
    """
    if name not in suite_names():
        raise ValueError(
            f"targets: {name!r} is not allowed; must be a list of fold words or one of the suites "
            f"{', '.join(suite_names())}"
        )
    path = _folder() / f"{name}.yaml"
    try:
        return Suite(**yaml.safe_load(path.read_text(encoding="utf-8")))
    except SceneError as error:
        raise SceneError(error.problems, source=str(path)) from None


def _folder() -> Path:
    return configs_dir() / "suites"
