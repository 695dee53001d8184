"""The diagram of this benchmark. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

from typing import Any

from magfold_env.benchmarks.predict.experiment import bar_of
from magfold_env.ensembles.bars import Bar
from magfold_env.reporting.drawing import Drawing
from magfold_env.reporting.part import Row


def draw_experiment(rows: list[Row]) -> Any:
    """Return the bars of the nine ensembles, a row a sequence: the paper's Figure 18."""
    from magfold_env.render.ensembles import bar_chart  # noqa: PLC0415 - an extra

    panels: dict[str, list[Bar]] = {}
    for row in rows:
        name = f"sequence {row['sequence']}, {row['mode']}: {row['runs']} releases"
        panels.setdefault(name, []).append(bar_of(row))
    return bar_chart(panels)


DRAWINGS: dict[str, Drawing] = {"experiment": draw_experiment}
