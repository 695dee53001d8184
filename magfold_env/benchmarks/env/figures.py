"""Diagrams of the environments' benchmark. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

from typing import Any

import numpy as np

from magfold_env.benchmarks.env import episodes, overhead, peers, quasistatic
from magfold_env.reporting.plotting import COLOURS, INK, MARKERS, Drawing, numbers, panels
from magfold_env.reporting.tables import Row


def _quartiles(rows: list[Row], what: str) -> Any:
    """Return how far the quartiles of a rate lie below and above its median."""
    middle = numbers(rows, what)
    low, high = numbers(rows, "lower quartile"), numbers(rows, "upper quartile")
    return np.stack([middle - low, high - middle])


def draw_episodes(rows: list[Row]) -> Any:
    """Episodes a second against the length, a panel a clock."""
    figure, axes = panels(len(episodes.WAYS), "Tube-feed episodes a second, dynamics")
    for axis, (clock, ways) in zip(axes, episodes.WAYS.items(), strict=True):
        for k, way in enumerate(ways):
            mine = [
                row
                for row in rows
                if (row["clock"], row["form"], row["threads"]) == (clock, way.form, way.threads)
            ]
            axis.errorbar(
                numbers(mine, "n"),
                numbers(mine, "episodes/s"),
                _quartiles(mine, "episodes/s"),
                color=COLOURS[k + 1],
                marker=MARKERS[k],
                markersize=5,
                capsize=3,
                label=f"{way}",
            )
        threads = max(way.threads for way in ways)
        wanted = episodes.WANTED[threads]
        axis.plot(episodes.JUDGED, wanted, "_", color=INK, markersize=22, markeredgewidth=2)
        axis.annotate(
            f"asked for: {wanted:g}",
            (episodes.JUDGED, wanted),
            (14, -3),
            textcoords="offset points",
            fontsize=9,
            color=INK,
        )
        axis.set_yscale("log")
        axis.set_title(f"{clock}", fontsize=11)
        axis.set_xlabel("components n")
        axis.set_xticks(sorted({int(row["n"]) for row in rows}))
        axis.legend(fontsize=9, frameon=False, loc="lower left")
    axes[0].set_ylabel("episodes a second")
    return figure


def draw_quasistatic(rows: list[Row]) -> Any:
    """Draw steps a second as bars."""
    figure, axes = panels(1, "Quasistatic tube-feed steps a second, one core", 7.0, 3.2)
    labels = [f"{row['form']}, shaping {row['shaping']}" for row in rows]
    _bars(axes[0], labels, rows, "steps/s", COLOURS[1])
    axes[0].axvline(quasistatic.WANTED, color=INK, linestyle="--", linewidth=1.0)
    return figure


def draw_overhead(rows: list[Row]) -> Any:
    """Python's share of a vector step against the number of environments, a panel a fidelity."""
    fidelities = list(dict.fromkeys(str(row["fidelity"]) for row in rows))
    figure, axes = panels(len(fidelities), "Python's share of a vector step")
    counts = sorted({int(row["envs"]) for row in rows})
    step, env = overhead.WANTED
    for axis, fidelity in zip(axes, fidelities, strict=True):
        groups = [
            (key[1], mine) for key, mine in overhead.groups(rows).items() if key[0] == fidelity
        ]
        for k, (way, mine) in enumerate(groups):
            axis.loglog(
                numbers(mine, "envs"),
                numbers(mine, "time [µs]"),
                color=COLOURS[1 + k],
                marker=MARKERS[k],
                markersize=5,
                label=way,
            )
        allowed = [overhead.allowed(count) for count in counts]
        asked = f"asked for: {step:g} µs + {env:g} µs an environment"
        axis.loglog(counts, allowed, color=INK, linestyle=":", label=asked)
        axis.set_title(fidelity, fontsize=11)
        axis.set_xticks(counts, [f"{count}" for count in counts])
        axis.minorticks_off()
        axis.set_xlabel("environments")
    axes[0].set_ylabel("time [µs]")
    lines, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        lines, labels, fontsize=9, frameon=False, loc="outside lower center", ncols=len(labels)
    )
    return figure


def draw_peers(rows: list[Row]) -> Any:
    """Draw steps and episodes a second of all tasks, alone and side by side."""
    figure, axes = panels(2, "Beside other tasks, one core, random actions", 6.0, 3.8, shared=False)
    titles = list(dict.fromkeys(str(row["task"]) for row in rows))
    for axis, what in zip(axes, ("steps/s", "episodes/s"), strict=True):
        for k, form in enumerate((peers.SINGLE, peers.VECTOR)):
            mine = [row for row in rows if row["form"] == form]
            axis.plot(
                numbers(mine, what),
                np.arange(len(titles)),
                color=COLOURS[k + 1],
                linestyle="none",
                marker=MARKERS[k],
                markersize=8,
                label=form,
            )
        axis.set_yticks(np.arange(len(titles)), titles)
        axis.set_ylim(-0.5, len(titles) - 0.5)
        axis.set_xscale("log")
        axis.set_xlabel(what)
        axis.invert_yaxis()
    lines, labels = axes[0].get_legend_handles_labels()
    figure.legend(lines, labels, fontsize=9, frameon=False, loc="outside lower center", ncols=2)
    return figure


def _bars(axis: Any, labels: list[str], rows: list[Row], what: str, colour: str) -> None:
    places = np.arange(len(rows))
    axis.barh(places, numbers(rows, what), xerr=_quartiles(rows, what), color=colour, capsize=3)
    axis.set_yticks(places, labels)
    axis.invert_yaxis()
    axis.set_xlabel(what)


DRAWINGS: dict[str, Drawing] = {
    episodes.NAME: draw_episodes,
    quasistatic.NAME: draw_quasistatic,
    overhead.NAME: draw_overhead,
    peers.NAME: draw_peers,
}
