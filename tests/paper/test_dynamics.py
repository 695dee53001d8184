"""Tests that statements about Figures 11 to 16 follow from the measured errors and times."""

import numpy as np
import pytest

from magfold_bench.laws.integrators import EULER
from magfold_bench.paper import figures_11_12, figures_13_14, motions, pendulum
from magfold_bench.paper.figures_11_12 import EARLY, ERROR, FIGURE_11, FIGURE_12
from magfold_bench.paper.pendulum import FIGURE_15, FIGURE_16
from magfold_bench.paper.reproduction import Measured
from magfold_bench.scaling import DENSE, SCALAR
from magfold_bench.tables import Row, growth, select
from tests.paper.measured import changed, outcomes

CASES = (motions.HALF, motions.WHOLE)


def steps(own: float = 1e-4) -> Measured:
    """Return equal first-order errors that end in one word."""
    means: list[Row] = []
    for name in CASES:
        for count in (1, 5, 20):
            row: Row = {"charge": name, "steps per frame": count, "Δt [ms]": 1e3 / (240.0 * count)}
            row[ERROR] = 1.0
            early = {ERROR: 1e-2, figures_11_12.OWN: own, figures_11_12.SMOOTH: own}
            row |= {EARLY + key: error / count**2 for key, error in early.items()}
            ends = {"word": "LRLLL", "ended": "folded", "reference": "LRLLL"}
            means.append({**row, **ends, "reference ended": "folded"})
    return {"means": means}


def test_figure_11_agrees_where_errors_are_small_and_ends_equal() -> None:
    assert outcomes(FIGURE_11.claims(steps())) == ["agrees"] * 4
    where: Row = {"charge": motions.HALF, "steps per frame": 20}
    found = FIGURE_11.claims(changed(steps(), "means", where, word="RRRRR"))
    assert outcomes(found) == ["agrees", "disagrees", "agrees", "agrees"]
    assert "LRLLL, RRRRR" in found[1].found


def points(word: str, difference: float, force: float) -> Measured:
    means: list[Row] = [
        {
            "charge": name, "h": h, EARLY + figures_11_12.MANY: difference,
            "whole fold, " + figures_11_12.MANY: difference, "word": word if h == 3 else "LRLLL",
            "reference": "LRLLL", "reference ended": "folded",
        }
        for name in CASES
        for h in figures_11_12.COUNTS
    ]  # fmt: skip
    forces: list[Row] = [
        {"gap [mm]": gap, "h": h, "magnets / exact": force}
        for h in figures_11_12.COUNTS
        for gap in (0.5, 1.0, 2.0)
    ]
    return {"means": means, "forces": forces}


def test_figure_12_judges_difference_end_and_force() -> None:
    assert outcomes(FIGURE_12.claims(points("LRLLL", 1e-4, 1.01))) == ["agrees"] * 5
    assert outcomes(FIGURE_12.claims(points("LRLLL", 0.1, 5.0))) == ["disagrees"] * 5
    other = outcomes(FIGURE_12.claims(points("RRRRR", 1e-4, 1.01)))
    assert other == ["agrees", "disagrees", "agrees", "disagrees", "agrees"]


ORDER = figures_13_14.ORDER


def followed() -> Measured:
    folds: list[Row] = [
        {"charge": name, "made by": made_by, "word": "LRLLL", "ended": "folded",
         ORDER: "1 2 3", "energy won [mJ]": 0.0, "magnets set free [mJ]": 9.0}
        for name in CASES
        for made_by in (figures_13_14.PAPER, figures_13_14.OURS, figures_13_14.DEVICE)
    ]  # fmt: skip
    apart: list[Row] = [
        {"charge": motions.WHOLE, "different": "both", "displacement [mm]": 8.0,
         "before the first snap [mm]": 1.0, "angle [rad]": 0.4, "before the first snap [rad]": 0.1,
         "largest jump [mm]": 5.0, "jump at [s]": 0.1, "snap beside it": "yes"}
    ]  # fmt: skip
    return {"folds": folds, "differences": apart}


SHAPES, PASSIVE = slice(0, 2), slice(2, 4)
DISTANCES, SHUT, JUMPS = slice(4, 6), 6, 7
PAPER: Row = {"charge": motions.WHOLE, "made by": figures_13_14.PAPER}


def test_figures_13_and_14_judge_shape_energy_distance_order_and_jumps() -> None:
    found = outcomes(figures_13_14.claims(followed()))
    assert found[SHAPES] == found[PASSIVE] == found[DISTANCES] == ["agrees"] * 2
    assert found[SHUT] == "disagrees"  # the paper says that the orders differ
    assert found[JUMPS] == "agrees"
    measured = changed(followed(), "folds", PAPER, **{"energy won [mJ]": 7.0, ORDER: "2 1 3"})
    far = {"displacement [mm]": 40.0, "angle [rad]": 2.0, "snap beside it": "no"}
    found = outcomes(figures_13_14.claims(changed(measured, "differences", {}, **far)))
    assert found[PASSIVE] == ["agrees", "disagrees"]
    assert found[DISTANCES] == ["disagrees"] * 2
    assert (found[SHUT], found[JUMPS]) == ("agrees", "disagrees")


def test_a_swinging_pendulum_keeps_its_energy_which_is_that_of_the_centres() -> None:
    assert pendulum.engine_change(1.0 / 1200.0, 1e-9) < 1e-9
    scene = pendulum.problem()
    gravity = float(np.hypot(*scene.gravity.in_plane))
    below = scene.casing.diagonal * (np.arange(scene.n) + 0.5)
    assert pendulum.depth(scene) == pytest.approx(gravity * float(scene.masses @ below))


def energies(euler: tuple[float, ...], tight: float, other: float) -> Measured:
    names = {EULER: euler, "better": (other,) * 3}
    names["this project's solver, tolerance 1e-10"] = (tight,) * 3
    rows: list[Row] = [
        {"integrator": name, "steps per frame": n, "Δt [ms]": 4.0 / n, pendulum.CHANGE: change}
        for name, changes in names.items()
        for n, change in zip((1, 5, 20), changes, strict=True)
    ]
    return {"energy": rows, "broke-down": []}


def test_figure_15_judges_the_fall_and_what_better_methods_do() -> None:
    assert outcomes(FIGURE_15.claims(energies((1.0, 0.1, 0.01), 1e-9, 1e-4))) == ["agrees"] * 3
    rising = outcomes(FIGURE_15.claims(energies((0.01, 0.1, 1.0), 2.0, 3.0)))
    assert rising == ["disagrees"] * 3


def times(short: float, long: float) -> Measured:
    """Return times that grow with one power of n up to 60 and with another one up to 450."""
    rows: list[Row] = []
    for n in (1, 6, 20, 60, 200, 450):
        dense = 60.0**short * (n / 60.0) ** (short if n <= 60 else long)
        rows.append({"contender": DENSE, "n": n, "time [µs]": dense, "times one chain's": 7.0})
        rows.append({"contender": SCALAR, "n": n, "time [µs]": 0.1 * n, "times one chain's": 1.0})
    return {"times": rows, "absent": [{"peer": "a peer"}]}


def test_figure_16_judges_powers_of_the_length() -> None:
    agreeing = outcomes(FIGURE_16.claims(times(1.0, 2.0)))
    assert agreeing == ["agrees", "agrees", "cannot be compared"]
    other = outcomes(FIGURE_16.claims(times(2.0, 3.0)))
    assert other == ["disagrees", "disagrees", "cannot be compared"]
    rows = times(1.0, 2.0)["times"]
    assert growth(select(rows, contender=DENSE), 60, 450) == pytest.approx(2.0)
    assert growth(select(rows, contender=SCALAR), 6, 450) == pytest.approx(1.0)
