"""Diagrams of the magnets benchmark. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

from typing import Any

from magfold_env.benchmarks.magnets.accuracy import BOUND, NODES, POINTS
from magfold_env.benchmarks.magnets.devices import DEFAULT
from magfold_env.benchmarks.magnets.far import NONE, ORDERS
from magfold_env.benchmarks.magnets.fold import ASKED
from magfold_env.benchmarks.magnets.magpylib_peer import MAGPYLIB
from magfold_env.benchmarks.magnets.peers import DYNAMICS, SUMS
from magfold_env.benchmarks.magnets.points import PAPER, SHOWN, rows_at
from magfold_env.benchmarks.magnets.scaling import LONG, STEEPEST
from magfold_env.laws.exact_magnets import CHARGES
from magfold_env.reporting.plotting import COLOURS, INK, MARKERS, Drawing, numbers, panels
from magfold_env.reporting.tables import Row

FLUSH = "force between two flush opposite faces"
SMALLEST = 1e-8  # error that is drawn; below it the reference's own may show
CONTENDERS = {MAGPYLIB: "magpylib getFT", SUMS: "engine, sums", DYNAMICS: "engine, dynamics"}
SETTINGS = {POINTS: "charges a face", NODES: "nodes a face", BOUND: "bound"}
SLOPES = {STEEPEST: ":", 2.0: "-."}  # powers of n beside the times, and their lines


def draw_accuracy(rows: list[Row]) -> Any:
    """Worst error against time, a panel a kind of states; settings are written at the points."""
    states = list(dict.fromkeys(str(row["states"]) for row in rows))
    models = list(dict.fromkeys(str(row["model"]) for row in rows))
    figure, axes = panels(
        len(states), "Magnet forces: worst error against time", 4.4, 4.6, shared=False
    )
    for axis, name in zip(axes, states, strict=True):
        for k, model in enumerate(models):
            mine = [row for row in rows if (row["states"], row["model"]) == (name, model)]
            axis.loglog(
                numbers(mine, "time [µs]"),
                numbers(mine, "worst error").clip(min=SMALLEST),
                color=COLOURS[(2, 1, 3)[k % 3]],
                marker=MARKERS[k],
                markersize=5,
                linewidth=2.2 if model == BOUND else 1.3,
                zorder=3 if model == BOUND else 2,
                label=f"{model} ({SETTINGS[model]})",
            )
            for row in mine:
                axis.annotate(
                    f"{float(row['setting']):g}",
                    (float(row["time [µs]"]), max(float(row["worst error"]), SMALLEST)),
                    (-5, -4) if model == BOUND else (5, 4),
                    textcoords="offset points",
                    ha="right" if model == BOUND else "left",
                    va="top" if model == BOUND else "bottom",
                    fontsize=8,
                    color=COLOURS[(2, 1, 3)[k % 3]],
                )
        axis.set_title(name, fontsize=11)
        axis.margins(x=0.13)  # room for the settings beside the outermost points
        axis.set_xlabel("time of a state [µs]")
        axis.set_ylim(SMALLEST / 2.0, 100.0)
    axes[0].set_ylabel(f"worst error / {FLUSH}")
    lines, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        lines, labels, fontsize=9, frameon=False, loc="outside lower center", ncols=len(models)
    )
    return figure


def draw_points(rows: list[Row]) -> Any:
    """Draw the force between two magnets over the exact one: against the gap, and against h."""
    figure, axes = panels(
        2, "Two magnets, h point charges a pole face: force over the exact force", shared=False
    )
    for k, count in enumerate(CHARGES):
        mine = [row for row in rows if row["h"] == count]
        axes[0].loglog(
            numbers(mine, "gap [mm]"),
            numbers(mine, "magnets / exact"),
            color=COLOURS[k],
            linewidth=2.2 if count == PAPER else 1.3,
            label=f"h = {count}",
        )
    axes[0].set_xlabel("gap between the magnets [mm]")
    for k, gap in enumerate(SHOWN):
        mine = rows_at(rows, gap)
        label = f"gap {float(mine[0]['gap [mm]']):.2g} mm"
        axes[1].loglog(
            numbers(mine, "h"),
            numbers(mine, "magnets / exact"),
            color=COLOURS[k + 1],
            marker=MARKERS[k],
            markersize=5,
            label=label,
        )
    axes[1].set_xlabel("point charges a face, h")
    axes[1].set_xticks(CHARGES, [str(count) for count in CHARGES])
    axes[1].minorticks_off()
    for axis in axes:
        axis.axhline(1.0, color=INK, linewidth=1.0, linestyle="--")
        axis.legend(fontsize=9, frameon=False, loc="upper right")
    axes[0].set_ylabel("force / force with charged rectangles")
    return figure


def draw_scaling(rows: list[Row]) -> Any:
    """Time of all magnet forces against the length, log against log."""
    figure, axes = panels(1, "All magnet forces of a chain", width=7.5, height=5.0)
    axis = axes[0]
    chains = [row for row in rows if str(row["magnets"]).startswith("accuracy")]
    keys = list(dict.fromkeys((str(row["shape"]), str(row["magnets"])) for row in chains))
    shapes = list(dict.fromkeys(shape for shape, _ in keys))
    for k, (shape, magnets) in enumerate(keys):
        mine = [row for row in chains if (row["shape"], row["magnets"]) == (shape, magnets)]
        axis.loglog(
            numbers(mine, "n"),
            numbers(mine, "time [µs]"),
            color=COLOURS[shapes.index(shape) + 1],
            linestyle="-" if k % 2 == 0 else "--",
            marker=MARKERS[shapes.index(shape)],
            markersize=5,
            linewidth=1.6,
            label=f"{shape}, {magnets}",
        )
    first = [row for row in chains if (row["shape"], row["magnets"]) == keys[0]]
    longer = [row for row in first if int(row["n"]) >= LONG]
    if longer:
        n = numbers(longer, "n")
        for power, style in SLOPES.items():
            line = float(longer[0]["time [µs]"]) * (n / n[0]) ** power
            axis.loglog(
                n, line, color=INK, linewidth=1.2, linestyle=style, label=f"n to the {power:g}"
            )
    axis.set_xlabel("components n")
    axis.set_ylabel("time of an evaluation [µs]")
    axis.legend(fontsize=9, frameon=False, loc="upper left")
    return figure


def draw_far(rows: list[Row]) -> Any:
    """Error of the far field against time, a panel a chain; radii are written at the points.

    Times are those with the nodes of the middle bound.
    """
    chains = list(dict.fromkeys((int(row["n"]), str(row["shape"])) for row in rows))
    bounds = sorted({float(row["nodes of accuracy"]) for row in rows})
    bound = bounds[len(bounds) // 2]
    figure, axes = panels(
        len(chains),
        f"Far field: its error against time, with the nodes of accuracy {bound:g}",
        4.2,
        4.4,
        shared=False,
    )
    for axis, (n, shape) in zip(axes, chains, strict=True):
        here = [
            r for r in rows if (r["n"], r["shape"], r["nodes of accuracy"]) == (n, shape, bound)
        ]
        for k, (order, name) in enumerate(ORDERS.items()):
            mine = [row for row in here if row["order"] == order]
            mine.sort(key=lambda row: float(row["radius [diagonals]"]))
            axis.loglog(
                numbers(mine, "time [µs]"),
                numbers(mine, "error").clip(min=SMALLEST),
                color=COLOURS[k + 1],
                marker=MARKERS[k],
                markersize=5,
                label=name,
            )
            for row in mine:
                axis.annotate(
                    f"{float(row['radius [diagonals]']):g}",
                    (float(row["time [µs]"]), max(float(row["error"]), SMALLEST)),
                    (5, 4),
                    textcoords="offset points",
                    fontsize=7,
                    color=COLOURS[k + 1],
                )
        without = next(float(row["time [µs]"]) for row in here if row["order"] == NONE)
        axis.axvline(without, color=INK, linewidth=1.0, linestyle="--", label="without a far field")
        axis.set_title(f"n = {n}, {shape}", fontsize=11)
        axis.set_xlabel("time of an evaluation [µs]")
    axes[0].set_ylabel(f"worst error /\n{FLUSH}", fontsize=9)
    lines, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        lines, labels, fontsize=9, frameon=False, loc="outside lower center", ncols=len(labels)
    )
    return figure


def draw_devices(rows: list[Row]) -> Any:
    """Bars of the time over the default chain's, feature by feature, a colour a chain."""
    chains = list(dict.fromkeys((int(row["n"]), str(row["shape"])) for row in rows))
    names = [name for name in dict.fromkeys(str(row["feature"]) for row in rows) if name != DEFAULT]
    figure, axes = panels(1, "Magnets in the dynamics: time over the default chain's", 9.0, 5.0)
    axis = axes[0]
    height = 0.8 / len(chains)
    for k, (n, shape) in enumerate(chains):
        mine = [r for r in rows if (r["n"], r["shape"]) == (n, shape) and r["feature"] != DEFAULT]
        place = [names.index(str(row["feature"])) + (k + 0.5) * height - 0.4 for row in mine]
        shares = numbers(mine, "time / default")
        axis.barh(place, shares, 0.9 * height, color=COLOURS[k + 1], label=f"n = {n}, {shape}")
    axis.axvline(1.0, color=INK, linewidth=1.0, linestyle="--")
    axis.set_yticks(range(len(names)), names, fontsize=9)
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    axis.set_xlabel("time / time of the default chain")
    axis.legend(fontsize=9, frameon=False, loc="upper right")
    return figure


def draw_fold(rows: list[Row]) -> Any:
    """Bars of the average time by fold and accuracy; ticks stand for all pairs summed."""
    figure, axes = panels(1, "Magnets of a chain of six: average over a fold", 8.0, 4.6)
    axis = axes[0]
    names = list(dict.fromkeys(str(row["fold"]) for row in rows))
    bounds = list(dict.fromkeys(float(row["accuracy"]) for row in rows))
    for k, bound in enumerate(bounds):
        mine = [row for row in rows if row["accuracy"] == bound]
        place = [names.index(str(row["fold"])) + (k - 1) * 0.26 for row in mine]
        colour = COLOURS[k + 1]
        axis.bar(place, numbers(mine, "time [µs]"), 0.24, color=colour, label=f"accuracy {bound:g}")
        axis.scatter(place, numbers(mine, "all pairs summed [µs]"), color=colour, marker="_", s=130)
        if bound in ASKED:
            axis.axhline(ASKED[bound], color=colour, linewidth=1.0, linestyle="--")
    axis.set_xticks(range(len(names)), [name.replace(", ", "\n", 1) for name in names], fontsize=8)
    axis.set_ylim(0.0, 1.25 * float(numbers(rows, "all pairs summed [µs]").max()))
    axis.grid(visible=False, axis="x")
    axis.set_ylabel("time an evaluation [µs]")
    axis.set_xlabel(
        "dashed: at most that is asked for; short strokes: all pairs summed", fontsize=9
    )
    axis.legend(fontsize=9, frameon=False, loc="upper left", ncols=len(bounds))
    return figure


def draw_peers(rows: list[Row]) -> Any:
    """Error of the torques at the joints against time beside magpylib, a panel a chain."""
    chains = list(dict.fromkeys((int(row["n"]), str(row["shape"])) for row in rows))
    figure, axes = panels(len(chains), "Beside magpylib: worst error against time", 3.4, 4.2)
    for axis, (n, shape) in zip(axes, chains, strict=True):
        for k, (by, label) in enumerate(CONTENDERS.items()):
            mine = [r for r in rows if (r["n"], r["shape"], r["by"]) == (n, shape, by)]
            axis.loglog(
                1e-6 * numbers(mine, "time [µs]"),
                numbers(mine, "joint error"),
                color=COLOURS[(2, 1, 3)[k]],
                marker=MARKERS[k],
                markersize=5,
                label=label,
            )
        axis.set_title(f"n = {n}, {shape}", fontsize=11)
        axis.set_xlabel("time of an evaluation [s]")
    axes[0].set_ylabel("torque at a joint: worst error\n/ (side × flush force)", fontsize=9)
    axes[0].legend(fontsize=9, frameon=False, loc="upper right")
    return figure


DRAWINGS: dict[str, Drawing] = {
    "accuracy": draw_accuracy,
    "points": draw_points,
    "far": draw_far,
    "scaling": draw_scaling,
    "devices": draw_devices,
    "fold": draw_fold,
    "peers": draw_peers,
}
