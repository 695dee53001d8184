"""Self-folding chains of magnets: simulation, prediction by energy, and learning.

Public names are loaded on first use. Importing the package registers its environments with
Gymnasium, but does not load numba or the engine. `__init__.pyi` lists the public names.
"""

import ast
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from magfold_env.envs import register_envs

_LISTED = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
_MODULES = {
    name.name: str(line.module)
    for line in _LISTED
    if isinstance(line, ast.ImportFrom)
    for name in line.names
}

__all__ = list(sorted(_MODULES))  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Load a public name, or a package that contains public names."""
    if name == "__version__":
        return version(__name__)
    module = f"{__name__}.{name}"
    if name in _MODULES:
        value = getattr(import_module(_MODULES[name]), name)
        globals()[name] = value
        return value
    if any(f"{each}.".startswith(f"{module}.") for each in _MODULES.values()):
        return import_module(module)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


register_envs()
