"""Table 1 and Figure 6: the component-by-component search, where it ends and how it gets there."""

from __future__ import annotations

from pathlib import Path

from magfold_env.minimiser import minimise
from magfold_env.paper import states
from magfold_env.paper.figure_7 import drawn, pairs
from magfold_env.paper.quoted import TABLE_1
from magfold_env.paper.reproduction import Claim, Measured, Reproduction, select
from magfold_env.reporting.page import Picture
from magfold_env.reporting.tables import Progress, Row, Table

SHOWN = 1  # the sequence whose search Figure 6 draws


def measure(quick: bool, progress: Progress) -> Measured:
    """Search every sequence in both directions, with both models of its magnets."""
    rows: list[Row] = []
    for number, ends in TABLE_1.items():
        progress(number / len(TABLE_1), f"sequence {number}")
        for direction, stated in ends.items():
            for model in states.MODELS:
                best = minimise(states.scene_of(number, model), direction).best
                rows.append(
                    {
                        "sequence": number,
                        "direction": direction,
                        "magnets": model,
                        "word": best.word,
                        "state": states.names(number).get(best.word, "none of the five"),
                        "in the paper": stated,
                    }
                )
    return {"ends": rows, "decisions": decisions()}


def decisions() -> list[Row]:
    """Return how the search of sequence 1 decides joint after joint, in both directions."""
    scene = states.scene_of(SHOWN, "literal")
    rows: list[Row] = []
    for direction in TABLE_1[SHOWN]:
        found = minimise(scene, direction)
        inside = found.best.coulomb_score - found.best.energy  # the score's constant part
        letters = ["S"] * (scene.n - 1)
        for step, decision in enumerate(found.decisions, start=1):
            letters[decision.joint - 1] = decision.letter
            least = min(option.energy for option in decision.options)
            rows.append(
                {
                    "direction": direction,
                    "step": step,
                    "joint": decision.joint,
                    "word": "".join(letters),
                    "score [mJ]": 1e3 * (least + inside),
                    "conflicts": "",
                    "stable": "no",
                }
            )
        last = found.best
        rows[-1] |= {"conflicts": pairs(last.conflicts), "stable": "yes" if last.stable else "no"}
    return rows


def tables(measured: Measured) -> list[Table]:
    """Return Table 1 with a column for each model."""
    shown: list[Row] = []
    for row in select(measured["ends"], magnets="literal"):
        same = {key: row[key] for key in ("sequence", "direction")}
        line: Row = {**same, "in the paper": row["in the paper"]}
        for model, name in states.MODELS.items():
            (found,) = select(measured["ends"], magnets=model, **same)
            line[f"here, {name}"] = f"{found['state']} ({found['word']})"
        shown.append(line)
    return [Table("Where the search ends", shown)]


def claims(measured: Measured) -> list[Claim]:
    """Compare state by state, for each model."""
    return [_claim(model, select(measured["ends"], magnets=model)) for model in states.MODELS]


def _claim(model: states.Model, rows: list[Row]) -> Claim:
    equal = [row for row in rows if row["state"] == row["in the paper"]]
    others = [row for row in rows if row not in equal]
    named = "; ".join(
        f"sequence {row['sequence']} {row['direction']} ends in {row['state']}" for row in others
    )
    return Claim(
        "six ends of the search, three sequences in two directions.",
        f"with {states.MODELS[model]}, {len(equal)} of {len(rows)} are the same"
        + (f": {named}." if named else "."),
        not others,
        built_in=True,
    )


def draw(measured: Measured, folder: Path) -> list[Picture]:
    """Draw the search of sequence 1 step by step, a picture a direction: Figure 6."""
    from magfold_env.render import draw_states  # noqa: PLC0415 - an extra

    pictures: list[Picture] = []
    for direction in TABLE_1[SHOWN]:
        rows = select(measured["decisions"], direction=direction)
        path = folder / f"figure-6-{direction}.png"
        draw_states(states.scene_of(SHOWN, "literal"), [drawn(row) for row in rows], path)
        order = ", ".join(str(row["joint"]) for row in rows)
        pictures.append(
            Picture(
                path,
                f"Figure 6's counterpart, {direction}: sequence {SHOWN} after each step of the "
                f"search, which decides the joints in the order {order}.",
            )
        )
    return pictures


REPRODUCTION = Reproduction(
    "table-1",
    "Table 1 and Figure 6: energy minimisation, component by component",
    shows="For each of three sequences the state in which a search ends that turns one joint "
    "after the other, from the first (forward) or from the last (backward): a chain that leaves "
    "a tube slowly. Figure 6 draws the steps for sequence 1.",
    computed="The same search: the letter of least energy joint by joint, all magnets acting, the "
    "joints to come straight, overlaps left out; once with the paper's point charges, once with "
    "magnets as they are built (charged rectangles, 0.6 T).",
    missing="The paper's drawings of its sequences are not at hand. The sequences here are "
    "reconstructed from its text, and states are named as there: A, B … by energy, stable ones "
    "first.",
    measure=measure,
    tables=tables,
    claims=claims,
    draw=draw,
)
