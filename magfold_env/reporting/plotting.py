"""What all diagrams share. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from magfold_env.files import replacing

DPI = 130
INK, GRID = "#26292e", "#d9dce0"
# Okabe and Ito's colours, which all kinds of sight tell apart.
COLOURS = ("#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")


def figure_class() -> Any:
    """Return matplotlib's figure class, which needs no display.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    """
    try:
        return importlib.import_module("matplotlib.figure").Figure
    except ImportError as error:
        msg = "diagrams need matplotlib: install the extra, pip install 'magfold_env[render]'"
        raise ImportError(msg) from error


def save_figure(figure: Any, path: str | Path) -> None:
    """Write a figure as PNG, under a temporary name first."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=DPI, facecolor="white")
