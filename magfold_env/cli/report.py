"""Tables and JSON that the `magfold` command shows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from rich.markup import escape
from rich.table import Table

from magfold_env.fold import Fold
from magfold_env.minimiser import Minimum, State, minimise
from magfold_env.paper.quoted import TABLE_1
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.simulate import energy

_MODES = ("forward", "backward")


def fold_table(fold: Fold, taken: float) -> Table:
    """Return how a fold ended; `taken` is the time the computer needed [s]."""
    scene = fold.scene
    mount = scene.mount
    if mount == "tube":
        mount += f", {scene.feed.direction}, {_range(scene.speeds)} m/s, {scene.feed.loading}"
    rows = {
        "sequence": " ".join(scene.sequence),
        "mount": mount,
        "word": fold.word or "(one component)",
        "status": f"{fold.status} ({fold.message})",
        "joint angles": " ".join(f"{angle:.1f}°" for angle in np.rad2deg(fold.joint_angles)),
        "energy, straight": _millijoules(energy(scene, np.zeros(scene.n))) + " mJ",
        "energy, at the end": _millijoules(fold.energy) + " mJ",
        "simulated time": f"{fold.time:.4f} s",
        "steps, evaluations": f"{fold.steps}, {fold.evaluations}",
        "computing time": f"{taken:.3f} s",
    }
    table = Table(show_header=False, title="Fold")
    for name, value in rows.items():
        table.add_row(name, escape(value))
    return table


def states_table(found: Minimum) -> Table:
    """Return the states of a search, lowest energy first; equal outlines have equal letters."""
    table = Table(
        title=f"States by energy ({found.mode}, {found.examined} words compared)",
        caption="Energies in mJ, the score with pairs inside components.\n"
        "Equal letters: equal outlines.",
    )
    _add_columns(table, "", "word", "energy", "score", "conflicts", "stable", "outline", "tied")
    outlines = list(dict.fromkeys(state.outline for state in found.states))
    for rank, state in enumerate(found.states, start=1):
        table.add_row(
            str(rank),
            state.word,
            _millijoules(state.energy),
            _millijoules(state.coulomb_score),
            _pairs(state),
            "yes" if state.stable else "no",
            _letter(outlines.index(state.outline)),
            " ".join(state.tied) or "none",
        )
    return table


def decisions_table(found: Minimum) -> Table:
    """Return how a component-by-component search decided each joint, in its order."""
    table = Table(title="Decisions", caption="Energies in mJ; -- is an overlap.")
    _add_columns(table, "joint", "energy S", "energy L", "energy R", "letter", "tied")
    for decision in found.decisions:
        energies = {option.letter: _millijoules(option.energy) for option in decision.options}
        table.add_row(
            str(decision.joint),
            *(energies.get(letter, "--") for letter in "SLR"),
            decision.letter,
            decision.tied or "none",
        )
    return table


def one_by_one_table(scene: Scene, feeds: Sequence[Minimum]) -> Table:
    """Return where component-by-component searches end, beside the paper's Table 1.

    The paper calls the stable states of sequence k SkA, SkB, ... by ascending energy.
    """
    number = _paper_number(scene)
    title = "Component-by-component search"
    table = Table(title=title if number is None else f"{title} (the paper's Table 1)")
    _add_columns(table, "direction", "word", "energy", "conflicts")
    names: dict[str, str] = {}
    if number is not None:
        stable = minimise(scene, top=len(_ALPHABET), among="stable").states
        names = {s.word: f"S{number}{_letter(k).upper()}" for k, s in enumerate(stable)}
        _add_columns(table, "state", "in the paper")
    for found in feeds:
        state = found.best
        cells = [found.mode, state.word, _millijoules(state.energy), _pairs(state)]
        if number is not None:
            cells += [names.get(state.word, "not stable"), TABLE_1[number][found.mode]]
        table.add_row(*cells)
    if len(feeds) < len(_MODES):
        table.caption = "A direction that is missing shuts itself in: every letter overlaps."
    return table


def scenes_table(scenes: Mapping[str, Scene]) -> Table:
    """Return the names of scenes with what sets them apart."""
    table = Table(title="Shipped scenes")
    _add_columns(table, "name", "n", "mount", "magnets", "solver", "sequence")
    for name, scene in scenes.items():
        magnets = "none" if scene.magnets is None else scene.magnets.model
        cells = (name, str(scene.n), scene.mount, magnets, scene.solver.method)
        table.add_row(*cells, " ".join(scene.sequence))
    return table


def searches_to_json(scene: Scene, *searches: Minimum) -> str:
    """Return searches as JSON text: the ranked one first, energies in J."""
    found = [
        {
            **asdict(search),
            "states": [{**asdict(state), "stable": state.stable} for state in search.states],
        }
        for search in searches
    ]
    data = {"scene": scene.model_dump(mode="json"), "searches": found}
    return json.dumps(data, indent=2, allow_nan=False) + "\n"


_ALPHABET = "abcdefghijklmnopqrstuvwxyz"


def _add_columns(table: Table, *names: str) -> None:
    """Add columns: numbers to the right, and a name is never broken."""
    for name in names:
        number = name in ("", "n", "joint", "score") or name.startswith("energy")
        table.add_column(name, justify="right" if number else "left", no_wrap=name == "name")


def _letter(index: int) -> str:
    """Return a, b, ..., z, aa, ab, ... for 0, 1, ..."""
    more, last = divmod(index, len(_ALPHABET))
    return (_letter(more - 1) if more else "") + _ALPHABET[last]


def _millijoules(joules: float) -> str:
    return f"{1e3 * joules:.4f}"


def _pairs(state: State) -> str:
    return ", ".join(f"{first}-{second}" for first, second in state.conflicts) or "none"


def _range(values: np.ndarray) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def _paper_number(scene: Scene) -> int | None:
    """Return which of the paper's sequences a scene has, if any."""
    for number in TABLE_1:
        if scene.sequence == load_scene(f"paper/sequence-{number}").sequence:
            return number
    return None
