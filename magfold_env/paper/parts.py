"""All figures and tables that are reproduced, in the paper's order."""

from __future__ import annotations

from magfold_env.paper import (
    figure_7,
    figure_11,
    figure_12,
    figure_15,
    figure_16,
    figure_18,
    figure_19,
    figures_13_14,
    table_1,
)
from magfold_env.paper.reproduction import Reproduction

_MODULES = (
    table_1, figure_7, figure_11, figure_12, figures_13_14, figure_15, figure_16, figure_18,
    figure_19,
)  # fmt: skip

PARTS: dict[str, Reproduction] = {each.REPRODUCTION.name: each.REPRODUCTION for each in _MODULES}
