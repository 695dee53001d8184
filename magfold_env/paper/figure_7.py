"""Figure 7: the five folded states of least energy of each sequence."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from magfold_env.paper import states
from magfold_env.paper.quoted import FROM_S2A, FROM_S2C, SEQUENCES
from magfold_env.paper.reproduction import Claim, Measured, Reproduction, select
from magfold_env.reporting.page import Picture
from magfold_env.reporting.tables import Progress, Row, Table
from magfold_env.shapes import cells, outline

NEAR = 0.005
"""Shares of an energy that differ by less than this agree."""

_RECONSTRUCTED = (
    "The sequences are reconstructions: a search over about a million geometries and all "
    "sequences found none with the printed energies, so these follow the statements of the text."
)


class Drawn(NamedTuple):
    """A state as it is drawn; its energy is the paper's score."""

    word: str
    energy: float
    conflicts: tuple[tuple[int, int], ...]
    stable: bool


def measure(quick: bool, progress: Progress) -> Measured:
    """List all full folds of every sequence in the paper's model, lowest energy first."""
    rows: list[Row] = []
    for number in SEQUENCES:
        progress(number / len(SEQUENCES), f"sequence {number}")
        for rank, state in enumerate(states.folded(number), start=1):
            rows.append(
                {
                    "sequence": number,
                    "rank": rank,
                    "state": states.names(number).get(state.word, ""),
                    "word": state.word,
                    "score [mJ]": 1e3 * state.coulomb_score,
                    "conflicts": pairs(state.conflicts),
                    "contacts": len(state.contacts),
                    "touching": pairs(state.contacts),
                    "stable": "yes" if state.stable else "no",
                }
            )
    return {"states": rows}


def tables(measured: Measured) -> list[Table]:
    """Return the five lowest states of each sequence."""
    columns = ("state", "word", "score [mJ]", "contacts", "conflicts", "stable")
    found: list[Table] = []
    for number in SEQUENCES:
        five = select(measured["states"], sequence=number)[: states.FIVE]
        shown: list[Row] = [{key: _cell(row, key) for key in columns} for row in five]
        found.append(Table(f"Sequence {number}", shown))
    return found


def _cell(row: Row, key: str) -> str | int | float:
    if key == "score [mJ]":
        return f"{float(row[key]):.4f}"
    return row[key] or "none"


def claims(measured: Measured) -> list[Claim]:
    """Compare with what section 4.1 says about the figure."""
    rows = measured["states"]
    by_name = {str(row["state"]): row for row in rows if row["state"]}
    return [
        _stable_states(rows),
        _outlines(by_name),
        _below_s1c(rows),
        _global_minimum(rows, by_name),
        _positive(by_name),
        _distance(by_name, "S2A", FROM_S2A),
        _distance(by_name, "S2C", FROM_S2C),
        _compact(rows),
    ]


def _stable_states(rows: list[Row]) -> Claim:
    counts = {n: len(select(rows, sequence=n, stable="yes")) for n in SEQUENCES}
    return Claim(
        "sequences 1 and 2 have several stable states, sequence 3 exactly one.",
        ", ".join(f"sequence {n} has {count}" for n, count in counts.items()) + ".",
        counts[1] > 1 and counts[2] > 1 and counts[3] == 1,
        built_in=True,
    )


def _outlines(by_name: dict[str, Row]) -> Claim:
    one, three = by_name["S1A"], by_name["S3A"]
    same = outline(str(one["word"])) == outline(str(three["word"]))
    scores = [float(row["score [mJ]"]) for row in (one, three)]
    return Claim(
        "S1A and S3A have the same outline and different energies.",
        f"their outlines are {'equal' if same else 'different'}, their scores are "
        f"{scores[0]:.2f} and {scores[1]:.2f} mJ.",
        same and abs(scores[0] - scores[1]) > NEAR * abs(scores[0]),
        built_in=True,
    )


def _below_s1c(rows: list[Row]) -> Claim:
    """Compare what the discussion says of the states below S1C."""
    mine = select(rows, sequence=1)
    below = mine[: [row["state"] for row in mine].index("S1C")]
    conflicts = [row for row in below if row["conflicts"]]
    named = ", ".join(f"{row['state']}{'*' if row['conflicts'] else ''}" for row in below)
    return Claim(
        "below S1C lie S1A, one more stable state and one with a conflict, between 4 and 5.",
        f"below S1C lie {named} (* has a conflict).",
        len(below) - len(conflicts) == 2
        and below[0]["state"] == "S1A"
        and [row["conflicts"] for row in conflicts] == ["4-5"],
        built_in=True,
    )


def _global_minimum(rows: list[Row], by_name: dict[str, Row]) -> Claim:
    best, s2b = by_name["S2A"], by_name["S2B"]
    others = [r for r in select(rows, sequence=2, stable="yes") if r["state"] != "S2A"]
    more = int(best["contacts"]) - max((int(row["contacts"]) for row in others), default=0)
    turned = turned_joints(str(best["word"]), str(s2b["word"]))
    straight = is_straight(str(s2b["word"]))
    return Claim(
        "S2A is the global minimum of sequence 2; it differs from the straight line S2B in the "
        "angle between 4 and 5 alone, joins 3 to 6, and has more faces in contact than any other "
        "stable state.",
        f"S2A has rank {best['rank']} and differs from S2B in joint "
        f"{', '.join(map(str, turned))}; it touches along {best['touching']}, {more:+d} "
        f"against the next; S2B is {'a' if straight else 'no'} straight line.",
        best["rank"] == 1
        and turned == [4]
        and "3-6" in str(best["touching"]).split(", ")
        and more > 0
        and straight,
        built_in=True,
    )


def _positive(by_name: dict[str, Row]) -> Claim:
    scores = {name: float(by_name[name]["score [mJ]"]) for name in ("S2A", "S2B", "S2C")}
    return Claim(
        "scores may be positive, as those of sequence 2's stable states, because pairs of charges "
        "inside a component count.",
        ", ".join(f"{name} {score:+.3f} mJ" for name, score in scores.items()) + ".",
        min(scores.values()) > 0.0,
        built_in=True,
    )


def _distance(by_name: dict[str, Row], name: str, stated: float) -> Claim:
    """Compare how far a state's energy is from that of S2B."""
    s2b, other = (float(by_name[each]["score [mJ]"]) for each in ("S2B", name))
    found = abs(other - s2b) / abs(s2b)
    turned = turned_joints(str(by_name["S2B"]["word"]), str(by_name[name]["word"]))
    return Claim(
        f"the energies of S2B and {name} differ by {100 * stated:.2f} %.",
        f"they differ by {100 * found:.2f} % of S2B's; different joints: {len(turned)}.",
        abs(found - stated) < NEAR,
        _RECONSTRUCTED,
    )


def _compact(rows: list[Row]) -> Claim:
    """Compare whether lower stable states have at least as many contacts."""
    broken: list[str] = []
    for number in SEQUENCES:
        stable = select(rows, sequence=number, stable="yes")
        counts = [int(row["contacts"]) for row in stable]
        if counts != sorted(counts, reverse=True):
            listed = ", ".join(f"{row['state'] or row['word']} {row['contacts']}" for row in stable)
            broken.append(f"sequence {number}: {listed}")
    return Claim(
        "the lower the energy of a stable state, the more faces are in contact.",
        "in the order of energy, the numbers of contacts never rise."
        if not broken
        else f"in the order of energy, contacts rise somewhere: {'; '.join(broken)}.",
        not broken,
        ""
        if not broken
        else "Contacts are most of the energy, but faces that do not touch act on each other too.",
    )


def turned_joints(word: str, other: str) -> list[int]:
    """Return the numbers of the joints, from 1, in which two words differ."""
    return [k for k, (a, b) in enumerate(zip(word, other, strict=True), start=1) if a != b]


def is_straight(word: str) -> bool:
    """Whether the centres of a word's casings lie on a line."""
    places = cells(word)
    return int(np.linalg.matrix_rank(places - places[0])) <= 1


def drawn(row: Row) -> Drawn:
    """Return what is drawn of a row."""
    listed = [pair.split("-") for pair in str(row["conflicts"]).split(", ") if pair]
    conflicts = tuple((int(first), int(second)) for first, second in listed)
    return Drawn(
        str(row["word"]), 1e-3 * float(row["score [mJ]"]), conflicts, row["stable"] == "yes"
    )


def draw(measured: Measured, folder: Path) -> list[Picture]:
    """Draw the five lowest states of each sequence, a picture a sequence."""
    from magfold_env.render import draw_states  # noqa: PLC0415 - an extra

    pictures: list[Picture] = []
    for number in SEQUENCES:
        five = select(measured["states"], sequence=number)[: states.FIVE]
        path = folder / f"figure-7-sequence-{number}.png"
        draw_states(states.scene_of(number, "literal"), [drawn(row) for row in five], path)
        named = ", ".join(str(row["state"]) for row in five)
        pictures.append(
            Picture(
                path,
                f"Sequence {number}, from left to right {named}: word, Coulomb score, stability. "
                "Red and blue: north and south poles outward; numbers: components; rings: equal "
                "poles that touch.",
            )
        )
    return pictures


def pairs(touching: tuple[tuple[int, int], ...]) -> str:
    """Return pairs of components as a text like "1-2, 3-6"."""
    return ", ".join(f"{first}-{second}" for first, second in touching)


REPRODUCTION = Reproduction(
    "figure-7",
    "Figure 7: the five folded states of least energy",
    shows="For each sequence the five full folds of least Coulomb energy, drawn with their "
    "magnets; conflicts, where equal poles touch, are marked.",
    computed="The score of all full folds without overlap in the paper's model: point charges, "
    "three a pole face, pairs inside a component included, each pair counted once (equation 6 "
    "counts each twice). The paper gives no unit; here it is mJ.",
    missing="The paper's own sequences and energies: only two scores and two ratios are in its "
    "text.",
    measure=measure,
    tables=tables,
    claims=claims,
    draw=draw,
)
