"""Figures 6, 7 and 19 and Table 1: energies of folded states, and the searches for them."""

import numpy as np

from magfold_bench.laws.experiment import MODES, RUNS, SEQUENCES, paper_scene
from magfold_bench.paper import quoted, states
from magfold_bench.paper.figure_18 import inputs as release_inputs
from magfold_bench.paper.reproduction import Claim, Measured, Plot, Reproduction
from magfold_bench.tables import Progress, Row, Table, each_case, select
from magfold_env.ensembles.releases import ensemble
from magfold_env.fold import FoldStatus
from magfold_env.minimiser import State, minimise
from magfold_env.reporting.intervals import per_cent
from magfold_env.reporting.tables import joined_pairs
from magfold_env.shapes import cells, outline

NEAR = 0.005
"""Relative difference below which energies agree."""

SEARCHED = 1  # the sequence whose search Figure 6 shows
SCORE = "score [mJ]"

INPUTS = (
    "reconstructed sequences, geometry (side and inset) and the model of magnets; B_r scales all "
    "energies alike, and friction has no effect."
)
_RECONSTRUCTED = (
    "The sequences are reconstructions: a search over about a million geometries and all "
    "sequences found none with the printed energies, so they follow the statements in the text."
)
_NONE_FOUND = (
    "A search over about a million geometries and all sequences found none with the printed "
    "energies."
)


def state_row(state: State) -> Row:
    """Return a state as a row for pictures and tables."""
    return {
        "word": state.word,
        SCORE: 1e3 * state.coulomb_score,
        "conflicts": joined_pairs(state.conflicts),
        "contacts": len(state.contacts),
        "touching": joined_pairs(state.contacts),
        "stable": "yes" if state.stable else "no",
    }


# --- Table 1 and Figure 6: the search component by component ---------------------------------


def search(quick: bool, progress: Progress) -> Measured:
    """Minimise each sequence's energy, for both feed directions and both magnet models."""
    rows: list[Row] = []
    for number, _ in each_case(progress, SEQUENCES, "sequence {}".format):
        for direction, stated in quoted.TABLE_1[number].items():
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
    """Return the decisions of sequence 1's search, joint by joint, in both directions."""
    scene = states.scene_of(SEARCHED, "literal")
    rows: list[Row] = []
    for direction in quoted.TABLE_1[SEARCHED]:
        found = minimise(scene, direction)
        inside = found.best.coulomb_score - found.best.energy  # the score's constant part
        letters = ["S"] * (scene.n - 1)
        for step, decision in enumerate(found.decisions, start=1):
            letters[decision.joint - 1] = decision.letter
            least = min(option.energy for option in decision.options)
            row: Row = {"direction": direction, "step": step, "joint": decision.joint}
            row |= {"word": "".join(letters), SCORE: 1e3 * (least + inside)}
            rows.append(row | {"conflicts": "", "stable": "no"})
        last = state_row(found.best)
        rows[-1] |= {key: last[key] for key in ("conflicts", "stable")}
    return rows


def search_tables(measured: Measured) -> list[Table]:
    """Return Table 1 with one column per model."""
    shown: list[Row] = []
    for row in select(measured["ends"], magnets="literal"):
        same = {key: row[key] for key in ("sequence", "direction")}
        line: Row = {**same, "in the paper": row["in the paper"]}
        for model, name in states.MODELS.items():
            (found,) = select(measured["ends"], same, magnets=model)
            line[f"here, {name}"] = f"{found['state']} ({found['word']})"
        shown.append(line)
    return [Table("Where the search ends", shown)]


def search_claims(measured: Measured) -> list[Claim]:
    """Judge, for each magnet model, whether the searches end in the paper's states."""
    made: list[Claim] = []
    for model, name in states.MODELS.items():
        rows = select(measured["ends"], magnets=model)
        others = [row for row in rows if row["state"] != row["in the paper"]]
        named = "; ".join(
            f"sequence {row['sequence']} {row['direction']} ends in {row['state']}"
            for row in others
        )
        made.append(
            Claim(
                f"six ends of the search, three sequences in two directions (here with {name}).",
                f"{len(rows) - len(others)} of {len(rows)} are the same"
                + (f": {named}." if named else "."),
                not others,
                built_in=True,
            )
        )
    return made


def search_plots(measured: Measured) -> list[Plot]:
    """Draw sequence 1's search step by step, as in Figure 6, with one picture per direction."""
    made: list[Plot] = []
    for direction in quoted.TABLE_1[SEARCHED]:
        rows = select(measured["decisions"], direction=direction)
        order = ", ".join(str(row["joint"]) for row in rows)
        caption = (
            f"Figure 6's counterpart, {direction}: sequence {SEARCHED} after each step of the "
            f"search, which decides the joints in the order {order}."
        )
        made.append(states.plot(f"figure-6-{direction}", SEARCHED, rows, caption))
    return made


TABLE_1 = Reproduction(
    "table-1",
    "Table 1 and Figure 6: energy minimisation, component by component",
    "Energy minimisation",
    shows="For each of three sequences, the state in which a search ends that turns one joint "
    "after another, from the first (forward) or the last (backward), like a chain that leaves "
    "a tube slowly. Figure 6 shows the steps for sequence 1.",
    computed="The same search: joint by joint, the letter of least energy; all magnets act, later"
    " joints are straight, overlaps are excluded. Once with the paper's point charges, once with "
    "magnets as they are built (charged rectangles, 0.6 T).",
    missing="The paper's drawings of its sequences are not available. The sequences here are "
    "reconstructed from its text, and states are named as there: A, B … by energy, stable states "
    "first.",
    measure=search,
    tables=search_tables,
    claims=search_claims,
    plots=search_plots,
    inputs=INPUTS,
)


# --- Figure 7: the five folded states of least energy ----------------------------------------


def lowest(quick: bool, progress: Progress) -> Measured:
    """List all full folds of every sequence in the paper's model, the lowest energy first."""
    rows: list[Row] = []
    for number, _ in each_case(progress, SEQUENCES, "sequence {}".format):
        for rank, state in enumerate(states.folded(number), start=1):
            name = states.names(number).get(state.word, "")
            case: Row = {"sequence": number, "rank": rank, "state": name}
            rows.append(case | state_row(state))
    return {"states": rows}


def _five(measured: Measured) -> dict[int, list[Row]]:
    """Return the five states of least energy of each sequence, by the sequence's number."""
    every = measured["states"]
    return {n: select(every, sequence=n)[: states.FIVE] for n in SEQUENCES}


def lowest_tables(measured: Measured) -> list[Table]:
    """Return the five lowest states of each sequence."""
    columns = ("state", "word", SCORE, "contacts", "conflicts", "stable")
    made: list[Table] = []
    for number, five in _five(measured).items():
        shown = [{key: row[key] or "none" for key in columns} for row in five]
        made.append(Table(f"Sequence {number}", [with_digits(row, SCORE) for row in shown]))
    return made


def with_digits(row: Row, *columns: str) -> Row:
    """Return a row in which numbers in some columns have four decimals."""
    return row | {column: f"{float(row[column]):.4f}" for column in columns}


def lowest_claims(measured: Measured) -> list[Claim]:
    """Compare the states with what section 4.1 of the paper states about the figure."""
    rows = measured["states"]
    by_name = {str(row["state"]): row for row in rows if row["state"]}
    counts = {n: len(select(rows, sequence=n, stable="yes")) for n in SEQUENCES}
    several = Claim(
        "sequences 1 and 2 have several stable states, sequence 3 exactly one.",
        ", ".join(f"sequence {n} has {count}" for n, count in counts.items()) + ".",
        counts[1] > 1 and counts[2] > 1 and counts[3] == 1,
        built_in=True,
    )
    scores = {name: float(by_name[name][SCORE]) for name in ("S2A", "S2B", "S2C")}
    positive = Claim(
        "scores may be positive, like those of sequence 2's stable states, as pairs of charges "
        "inside a component count.",
        ", ".join(f"{name} {score:+.3f} mJ" for name, score in scores.items()) + ".",
        min(scores.values()) > 0.0,
        built_in=True,
    )
    return [
        several,
        _outlines(by_name),
        _below_s1c(rows),
        _global_minimum(rows, by_name),
        positive,
        _distance(by_name, "S2A", quoted.FROM_S2A),
        _distance(by_name, "S2C", quoted.FROM_S2C),
        _compact(rows),
    ]


def _outlines(by_name: dict[str, Row]) -> Claim:
    one, three = by_name["S1A"], by_name["S3A"]
    same = outline(str(one["word"])) == outline(str(three["word"]))
    scores = [float(row[SCORE]) for row in (one, three)]
    return Claim(
        "S1A and S3A have the same outline and different energies.",
        f"their outlines are {'equal' if same else 'different'}, their scores are "
        f"{scores[0]:.2f} and {scores[1]:.2f} mJ.",
        same and abs(scores[0] - scores[1]) > NEAR * abs(scores[0]),
        built_in=True,
    )


def _below_s1c(rows: list[Row]) -> Claim:
    """Judge the paper's statements about the states with less energy than S1C."""
    mine = select(rows, sequence=1)
    below = mine[: [row["state"] for row in mine].index("S1C")]
    conflicts = [row for row in below if row["conflicts"]]
    named = ", ".join(f"{row['state']}{'*' if row['conflicts'] else ''}" for row in below)
    return Claim(
        "below S1C lie S1A, one other stable state and one state with a conflict, between 4 and 5.",
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
    turned = states.turned_joints(str(best["word"]), str(s2b["word"]))
    places = cells(str(s2b["word"]))
    straight = int(np.linalg.matrix_rank(places - places[0])) <= 1
    return Claim(
        "S2A is the global minimum of sequence 2; it differs from the straight line S2B in the "
        "angle between 4 and 5 only, joins 3 to 6, and has more faces in contact than any other "
        "stable state.",
        f"S2A has rank {best['rank']} and differs from S2B in joint "
        f"{', '.join(map(str, turned))}; it touches along {best['touching']}, {more:+d} "
        f"more contacts than the next; S2B is {'a' if straight else 'no'} straight line.",
        best["rank"] == 1
        and turned == [4]
        and "3-6" in str(best["touching"]).split(", ")
        and more > 0
        and straight,
        built_in=True,
    )


def _distance(by_name: dict[str, Row], name: str, stated: float) -> Claim:
    """Compare a state's energy difference from S2B with the stated one."""
    s2b, other = (float(by_name[each][SCORE]) for each in ("S2B", name))
    found = abs(other - s2b) / abs(s2b)
    turned = states.turned_joints(str(by_name["S2B"]["word"]), str(by_name[name]["word"]))
    return Claim(
        f"the energies of S2B and {name} differ by {100 * stated:.2f} %.",
        f"they differ by {100 * found:.2f} % of S2B's; different joints: {len(turned)}.",
        abs(found - stated) < NEAR,
        _RECONSTRUCTED,
    )


def _compact(rows: list[Row]) -> Claim:
    """Judge whether, of two stable states, the lower one has at least as many contacts."""
    broken: list[str] = []
    for number in SEQUENCES:
        stable = select(rows, sequence=number, stable="yes")
        counts = [int(row["contacts"]) for row in stable]
        if counts != sorted(counts, reverse=True):
            listed = ", ".join(f"{row['state'] or row['word']} {row['contacts']}" for row in stable)
            broken.append(f"sequence {number}: {listed}")
    return Claim.unless(
        "the lower the energy of a stable state, the more faces are in contact.",
        f"in the order of energy, contacts rise somewhere: {'; '.join(broken)}."
        if broken
        else "in the order of energy, the numbers of contacts never rise.",
        not broken,
        "Contacts make up most of the energy, but faces that do not touch also interact.",
    )


def lowest_plots(measured: Measured) -> list[Plot]:
    """Draw the five lowest states of each sequence, one picture per sequence."""
    made: list[Plot] = []
    for number, five in _five(measured).items():
        named = ", ".join(str(row["state"]) for row in five)
        caption = (
            f"Sequence {number}, from left to right {named}: word, Coulomb score, stability. "
            "Red and blue: north and south poles outward; numbers: components; rings: equal "
            "poles that touch."
        )
        made.append(states.plot(f"figure-7-sequence-{number}", number, five, caption))
    return made


FIGURE_7 = Reproduction(
    "figure-7",
    "Figure 7: the five folded states of least energy",
    "Energy minimisation",
    shows="For each sequence, the five full folds with the least Coulomb energy, drawn with their "
    "magnets; conflicts, where equal poles touch, are marked.",
    computed="The score of all full folds without overlap in the paper's model: point charges, "
    "three per pole face; pairs inside a component count, and each pair counts once (equation 6 "
    "counts each pair twice). The paper gives no unit; here it is mJ.",
    missing="The paper's own sequences and energies: its text gives only two scores and two "
    "ratios.",
    measure=lowest,
    tables=lowest_tables,
    claims=lowest_claims,
    plots=lowest_plots,
    inputs=INPUTS,
)


# --- Figure 19: S1A and S1B, two states of nearly the same energy ----------------------------

STATED = {"S1A": quoted.SCORE_S1A, "S1B": quoted.SCORE_S1B}


def nearly_equal(quick: bool, progress: Progress) -> Measured:
    """Compute the energies of the paper's states S1A and S1B, and how often releases end there."""
    found = {state.word: state for state in states.folded(1)}
    rows: list[Row] = []
    for name, stated in STATED.items():
        row: Row = {"state": name, "in the paper": stated} | state_row(found[states.word_of(name)])
        order = ("state", "word", SCORE, "in the paper", "contacts", "conflicts", "stable")
        rows.append({column: row[column] for column in order})
    releases: list[Row] = []
    for mode, _ in each_case(progress, list(RUNS)):
        runs = RUNS[mode]
        made = ensemble(paper_scene(1, mode), runs)
        for name in STATED:
            share = made.probability(states.word_of(name), FoldStatus.FOLDED)
            case: Row = {"mode": mode, "releases": runs, "state": name}
            releases.append(case | {"share": share.rate, "low": share.low, "high": share.high})
    return {"states": rows, "releases": releases}


def nearly_equal_tables(measured: Measured) -> list[Table]:
    """Return both energies and the frequency of each state."""
    columns = ("state", "word", SCORE, "in the paper", "contacts")
    rows = [{key: row[key] for key in columns} for row in measured["states"]]
    energies = [with_digits(row, SCORE, "in the paper") for row in rows]
    columns = ("mode", "releases", "state")
    shares: list[Row] = [
        {**{key: row[key] for key in columns}, "share": _share(row)} for row in measured["releases"]
    ]
    return [Table("Coulomb scores", energies), Table("Simulated releases of sequence 1", shares)]


def _share(row: Row) -> str:
    return per_cent(*(float(row[key]) for key in ("share", "low", "high")))


def nearly_equal_claims(measured: Measured) -> list[Claim]:
    """Compare the energies and their order, and judge whether S1B occurs in releases."""
    a, b = measured["states"]
    scores = {str(row["state"]): float(row[SCORE]) for row in (a, b)}
    joints = states.turned_joints(str(a["word"]), str(b["word"]))
    order = Claim(
        "S1A lies below S1B, by less than one per cent.",
        f"by {100 * (1 - scores['S1B'] / scores['S1A']):.2f} % (the paper: "
        f"{100 * (1 - quoted.SCORE_S1B / quoted.SCORE_S1A):.2f} %); they differ in joint "
        f"{', '.join(map(str, joints))}.",
        0.99 * scores["S1A"] > scores["S1B"] > scores["S1A"],
        built_in=True,
    )
    printed: list[Claim] = []
    for name, stated in STATED.items():
        off = scores[name] / stated - 1.0
        found = f"{scores[name]:.4f} mJ, {100 * abs(off):.1f} % off."
        sentence = f"the score of {name} is {stated}."
        printed.append(Claim(sentence, found, abs(off) < NEAR, _NONE_FOUND))
    often = select(measured["releases"], state="S1B")
    listed = ", ".join(f"{row['mode']} {_share(row)}" for row in often)
    absent = Claim(
        "S1B does not occur in the experiment (says the figure's caption; section 6.1 gives it a "
        "probability).",
        f"its share of the simulated releases is {listed}.",
        not any(float(row["share"]) for row in often),
        "The two states differ in the place of component 1. The paper ascribes the absence of "
        "another state, S1E, to the wire that leaves component 1; the simulation has no wire.",
        inputs=release_inputs(1, list(MODES), ""),
    )
    return [order, *printed, absent]


def nearly_equal_plots(measured: Measured) -> list[Plot]:
    """Draw S1A and S1B."""
    caption = "S1A (left) and S1B (right), with their Coulomb scores."
    return [states.plot("figure-19", 1, measured["states"], caption)]


FIGURE_19 = Reproduction(
    "figure-19",
    "Figure 19: S1A and S1B",
    "Where releases end",
    shows="Two states of sequence 1 that differ little in shape and energy; that with more "
    "energy is said not to occur in the experiment.",
    computed="The scores of both in the paper's model, and how often each ends simulated "
    "releases in the three modes, as in Figure 18.",
    missing="The wire at component 1, which the simulation does not include.",
    measure=nearly_equal,
    tables=nearly_equal_tables,
    claims=nearly_equal_claims,
    plots=nearly_equal_plots,
    inputs=INPUTS,
)
