"""`magfold minimise`: rank states by energy, and search component by component."""

import json as jsons
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import Annotated, Any, cast

import typer
from rich.table import Table

from magfold_env import minimiser
from magfold_env.cli import options
from magfold_env.files import write_text
from magfold_env.reporting.tables import joined_pairs, letters
from magfold_env.scene import Scene, load_scene, scene_names

MODES: tuple[minimiser.Mode, ...] = ("forward", "backward")


def minimise(
    scene: options.SceneName,
    mode: options.Mode = "free",
    top: Annotated[int, typer.Option(help="Number of states to show.")] = 5,
    among: Annotated[
        str, typer.Option(help="Words to rank: all, folded (no S) or stable (and no conflict).")
    ] = "all",
    png: options.Png = None,
    json: options.Json = None,
) -> None:
    """Rank the states of a chain by magnetic energy, and search it component by component."""
    options.check_outputs({"--png": png, "--json": json})
    loaded = load_scene(scene)
    with options.progress_of(1.0) as tell:
        tell(0.0, "searching")
        # The options are text; the minimiser checks them.
        found = minimiser.minimise(
            loaded, cast("Any", mode), top, cast("Any", among),
            progress=lambda done: tell(done, "searching"),
        )  # fmt: skip
        tell(1.0, "component by component")
        feeds = _feeds(loaded)
    decisions = [decisions_table(found)] if found.decisions else []
    papers = scene.startswith("paper/") and scene in scene_names()
    options.show(states_table(found, papers), *decisions, one_by_one_table(feeds))
    options.save(
        (png, options.drawing("draw_states", loaded, found.states)),
        (json, lambda path: write_text(path, to_json(loaded, found, *feeds))),
    )


def _feeds(scene: Scene) -> list[minimiser.Minimum]:
    """Return the component-by-component searches that complete a fold."""
    found: list[minimiser.Minimum] = []
    for mode in MODES:
        # A search may block itself: with every letter, the next component then overlaps.
        with suppress(ValueError):
            found.append(minimiser.minimise(scene, mode))
    return found


def states_table(found: minimiser.Minimum, papers: bool) -> Table:
    """Return a table of a search's states, lowest energy first; equal outlines share a letter.

    If ``papers``, the table contains the paper's score and stability.
    """
    table = _table(
        f"States by energy ({found.mode}, {found.examined} words compared)",
        ("", "word", "energy", "score", "conflicts", "stable", "outline", "tied"),
        "Energies in mJ. Equal letters: equal outlines.",
    )
    outlines = list(dict.fromkeys(state.outline for state in found.states))
    for rank, state in enumerate(found.states, start=1):
        table.add_row(
            str(rank),
            state.word,
            options.millijoules(state.energy),
            options.millijoules(state.coulomb_score),
            joined_pairs(state.conflicts) or "none",
            "yes" if state.stable else "no",
            letters(outlines.index(state.outline)).lower(),
            " ".join(state.tied) or "none",
        )
    if not papers:
        table.columns = [each for each in table.columns if each.header not in ("score", "stable")]
    return table


def decisions_table(found: minimiser.Minimum) -> Table:
    """Return a table of the decisions of a component-by-component search, in their order."""
    columns = ("joint", "energy S", "energy L", "energy R", "letter", "tied")
    table = _table("Decisions", columns, "Energies in mJ; -- is an overlap.")
    for decision in found.decisions:
        energies = {
            option.letter: options.millijoules(option.energy) for option in decision.options
        }
        table.add_row(
            str(decision.joint),
            *(energies.get(letter, "--") for letter in "SLR"),
            decision.letter,
            decision.tied or "none",
        )
    return table


def one_by_one_table(feeds: Sequence[minimiser.Minimum]) -> Table:
    """Return a table of the results of component-by-component searches."""
    shut = "A direction that is missing shuts itself in: every letter overlaps."
    table = _table(
        "Component-by-component search",
        ("direction", "word", "energy", "conflicts"),
        None if len(feeds) == len(MODES) else shut,
    )
    for found in feeds:
        state = found.best
        conflicts = joined_pairs(state.conflicts) or "none"
        table.add_row(found.mode, state.word, options.millijoules(state.energy), conflicts)
    return table


def to_json(scene: Scene, *searches: minimiser.Minimum) -> str:
    """Return a scene and the results of searches as JSON text, the ranking first, energies in J."""
    found = [
        {
            **asdict(search),
            "states": [{**asdict(state), "stable": state.stable} for state in search.states],
        }
        for search in searches
    ]
    data = {"scene": scene.model_dump(mode="json"), "searches": found}
    return jsons.dumps(data, indent=2, allow_nan=False) + "\n"


def _table(title: str, names: Sequence[str], caption: str | None) -> Table:
    numbers = ("", "joint", "score")
    columns = {name: name in numbers or name.startswith("energy") for name in names}
    return options.table(title, columns, caption)
