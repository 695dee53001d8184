"""Figure 18: frequencies of the shapes of each sequence, by mode of release."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from magfold_bench.laws import experiment
from magfold_bench.laws.experiment import MODES, SEQUENCES, Kind
from magfold_bench.paper import states
from magfold_bench.paper.reproduction import Claim, Measured, Plot, Reproduction
from magfold_bench.paper.statements import on_the_way
from magfold_bench.tables import Progress, Row, Table, select
from magfold_env.fold import FoldStatus
from magfold_env.minimiser import Mode
from magfold_env.shapes import FloatArray, centres, headings, word_to_angles

FOLDED = FoldStatus.FOLDED.value
NEARLY = 1.05
"""Shapes whose movement is at most this factor times the least count as those of least movement."""
MOST = 0.5
OUTER = (4, 5)
"""The joints that turn when component 5 drags component 6 along."""

KINDS: dict[str, Kind] = {"bars": "", "strong": "-strong"}
"""The kinds of released scenes, by the name of their results."""


def measure(quick: bool, progress: Progress) -> Measured:
    """Release chains as often as the paper does, with the given magnets and with strong ones.

    Releases take only seconds, so ``quick`` does not reduce their number.
    """
    made: Measured = {}

    def tell(share: float, what: str) -> None:
        progress((len(made) + share) / len(KINDS), what)

    for name, kind in KINDS.items():
        made[name] = experiment.run(False, tell, kind).rows
    return made


def device(kind: Kind) -> str:
    """Return a description of the properties that distinguish a kind of chain."""
    scene = experiment.paper_scene(1, "free", kind)
    assert scene.magnets is not None
    return f"{scene.magnets.remanence:g} T, µ {scene.frictions[0]:g}"


def inputs(number: int, modes: Sequence[Mode], kind: Kind) -> str:
    """Return a description of the assumptions behind a verdict on a sequence's releases."""
    scene = experiment.paper_scene(number, modes[-1], kind)
    feed = "" if modes == ["free"] else f"feed {scene.feed.speed:g} m/s, "
    return (
        f"B_r and friction ({device(kind)}), {feed}spread of the release (joints "
        f"±{scene.start_angle_spread:g} rad), reconstructed sequence {number}."
    )


def tables(measured: Measured) -> list[Table]:
    """Return every outcome with its share and the paper's description, one table per device."""
    made: list[Table] = []
    for name, kind in KINDS.items():
        shown: list[Row] = []
        for number in SEQUENCES:
            for mode in MODES:
                stated = experiment.PAPER[number, mode]
                for row in select(measured[name], sequence=number, mode=mode):
                    interval = f"{100 * float(row['low']):.0f}–{100 * float(row['high']):.0f} %"
                    line: Row = {"sequence": str(number), "mode": mode, "releases": row["runs"]}
                    line |= {"ends in": named(number, str(row["word"])), "": str(row["status"])}
                    line |= {"share": _per_cent(float(row["probability"])), "95 %": interval}
                    shown.append(line | {"in the paper": stated})
                    stated = ""
        made.append(Table(f"Simulated releases, {device(kind)}", shown))
    return made


def named(number: int, word: str) -> str:
    """Return a word, with the paper's name for it if there is one."""
    name = states.names(number).get(word)
    return f"{word} = {name}" if name else word


def claims(measured: Measured) -> list[Claim]:
    """Compare the device, as given and with strong magnets, with sections 6.1 and 7."""
    made: list[Claim] = []
    for name, kind in KINDS.items():
        each = judge(measured[name], kind)
        made += [claim._replace(found=f"{device(kind)}: {claim.found}") for claim in each]
    return made


def judge(bars: list[Row], kind: Kind) -> list[Claim]:
    """Compare the releases of one kind of scene with the paper's statements."""
    free_and_forward = list(MODES[:2])
    judged: list[tuple[int, Sequence[Mode], Claim]] = [
        *((n, [mode], _least(bars, n, mode)) for n in (1, 2) for mode in free_and_forward),
        *((n, ["backward"], _even_split(bars, n)) for n in (1, 2)),
        (1, ["backward"], _named_split(bars)),
        *((3, [mode], _mostly_s3a(bars, mode)) for mode in MODES),
        (3, free_and_forward, _misfolds(bars)),
        (3, list(MODES), _modes_matter(bars)),
    ]
    return [claim._replace(inputs=inputs(n, modes, kind)) for n, modes, claim in judged]


def _least(bars: list[Row], number: int, mode: str) -> Claim:
    """Judge whether a chain reaches stable states of least movement, not the global minimum."""
    mine = select(bars, sequence=number, mode=mode)
    best = states.folded(number)[0].word
    least = least_moved(number)
    full = select(mine, status=FOLDED)
    most = str(full[0]["word"]) if full else ""
    misfolded = 1.0 - sum(float(row["probability"]) for row in full)
    share = sum(_rate(mine, word) for word in least)
    stopped = f"Most chains of sequence {number} come to rest before they are folded. "
    return Claim(
        f"sequence {number}, {mode}: most often the shape of least movement, not the global "
        "minimum.",
        f"{_per_cent(share)} of all releases end in the stable states of least movement "
        f"({', '.join(named(number, word) for word in least)}), {_per_cent(_rate(mine, best))} in "
        f"the global minimum ({named(number, best)}); "
        + (f"the most frequent full fold is {named(number, most)}; " if most else "none folds; ")
        + f"{_per_cent(misfolded)} stop before they are folded.",
        most in least and share > _rate(mine, best),
        ""
        if most in least
        else (stopped if misfolded > MOST else "")
        + "Static friction, masses and the spread of a release by hand are assumed, and the "
        "sequences are not the paper's own: small differences in energy decide which way a joint "
        "turns.",
    )


def _even_split(bars: list[Row], number: int) -> Claim:
    full = select(bars, sequence=number, mode="backward", status=FOLDED)
    listed = ", ".join(
        f"{named(number, str(r['word']))} {_per_cent(float(r['probability']))}" for r in full
    )
    even = len(full) > 1 and float(full[0]["low"]) <= float(full[1]["high"])
    return Claim.unless(
        f"sequence {number}, backward: nearly equal probabilities of several shapes.",
        f"{listed or 'no full fold'}; the intervals of the first two "
        f"{'overlap' if even else 'do not overlap'}.",
        even,
        "Several shapes occur, but one of them more often than the others.",
    )


def _named_split(bars: list[Row]) -> Claim:
    full = select(bars, sequence=1, mode="backward", status=FOLDED)
    first_two = [str(row["word"]) for row in full[:2]]
    wanted = [states.word_of("S1A"), states.word_of("S1C")]
    return Claim(
        "sequence 1, backward: these shapes are S1A and S1C, and S1B is much rarer.",
        f"the two most frequent are {' and '.join(named(1, word) for word in first_two)}.",
        set(first_two) == set(wanted),
        "They are S1A and S1C with the first joint turned the other way. It leaves the tube "
        "last, and in the reconstructed sequence its direction hardly changes the energy."
        if set(first_two) == {_first_turned(word) for word in wanted}
        else "",
    )


def _first_turned(word: str) -> str:
    """Return a word whose first joint turns the other way."""
    return {"L": "R", "R": "L"}.get(word[0], word[0]) + word[1:]


def _mostly_s3a(bars: list[Row], mode: str) -> Claim:
    """Judge whether sequence 3 mostly reaches its only stable state and otherwise misfolds."""
    goal = states.word_of("S3A")
    mine = select(bars, sequence=3, mode=mode)
    share = _rate(mine, goal)
    others = [row for row in mine if (row["word"], row["status"]) != (goal, FOLDED)]
    listed = ", ".join(
        f"{row['word']} {_per_cent(float(row['probability']))} {row['status']}" for row in others
    )
    folds = {row["word"] for row in select(mine, status=FOLDED)}
    apart = {str(row["word"]): _first_apart(str(row["word"]), goal) for row in others}
    astray = ", ".join(
        f"{word} has turned joint {joint} away from it" for word, joint in apart.items() if joint
    )
    return Claim.unless(
        f"sequence 3, {mode}: most often S3A, otherwise a misfold.",
        f"{_per_cent(share)} end in {named(3, goal)}{f', others in {listed}' if listed else ''}.",
        folds == {goal} and share > MOST,
        f"Not on the way to S3A: {astray}." if astray else "",
    )


def _first_apart(word: str, goal: str) -> int:
    """Return the number of the first joint that turned differently from the goal, or 0."""
    pairs = enumerate(zip(word, goal, strict=True), start=1)
    return next((joint for joint, (a, b) in pairs if a not in ("S", b)), 0)


def _misfolds(bars: list[Row]) -> Claim:
    """Judge whether misfolds of sequence 3 equal S3A, apart from joints that component 5 turns.

    It is not enough that an outer joint is straight: a chain that turned an inner joint the wrong
    way has blocked itself, and misfolds for a reason other than the paper's.
    """
    goal = states.word_of("S3A")
    mine = [row for row in select(bars, sequence=3) if row["mode"] in MODES[:2]]
    mine = [row for row in mine if row["status"] != FOLDED]
    total = sum(float(row["probability"]) for row in mine)
    there = sum(
        float(row["probability"]) for row in mine if on_the_way(str(row["word"]), goal, OUTER)
    )
    listed = ", ".join(f"{row['word']} ({row['mode']})" for row in mine)
    return Claim(
        "sequence 3 misfolds because component 5 has to drag 6 along, free and forward.",
        f"misfolds are {listed or 'none'}"
        + (
            f"; {_per_cent(there / total)} of them are {named(3, goal)} except for joints 4 or 5, "
            "which are straight."
            if mine
            else "."
        ),
        there > total / 2 if mine else None,
    )


def _modes_matter(bars: list[Row]) -> Claim:
    """Judge whether the share of misfolds of sequence 3 depends on the mode."""
    ends = {mode: _folded_interval(select(bars, sequence=3, mode=mode)) for mode in MODES}
    listed = ", ".join(f"{mode} {_per_cent(1.0 - rate)}" for mode, (rate, _, _) in ends.items())
    apart = max(low for _, low, _ in ends.values()) > min(high for _, _, high in ends.values())
    return Claim(
        "the mode of release measurably changes how often sequence 3 misfolds.",
        f"it misfolds {listed}; the intervals {'do not all' if apart else 'all'} overlap.",
        apart,
    )


def _folded_interval(rows: list[Row]) -> tuple[float, float, float]:
    """Return the share of folds into S3A, and its interval."""
    for row in select(rows, status=FOLDED, word=states.word_of("S3A")):
        return float(row["probability"]), float(row["low"]), float(row["high"])
    return 0.0, 0.0, 0.0


def _rate(rows: list[Row], word: str) -> float:
    """Return the frequency of full folds into a word."""
    return sum(float(r["probability"]) for r in select(rows, word=word, status=FOLDED))


def _per_cent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def movement(word: str) -> float:
    """Return how far centres move from a straight chain to a word, in units of the side.

    This is the root mean square over components, after the rotation and the shift that make it
    smallest (found by Kabsch's method).
    """
    one, other = _planar(np.zeros(len(word) + 1)), _planar(headings(word_to_angles(word)))
    turn = complex(np.vdot(other, one))
    return float(np.sqrt(np.square(np.abs(other * turn / abs(turn) - one)).mean()))


def _planar(angles: FloatArray) -> npt.NDArray[np.complex128]:
    """Return the casings' centres relative to their mean, as complex numbers, in sides."""
    places = centres(angles)
    flat = places[:, 0] + 1j * places[:, 1]
    return np.asarray(flat - flat.mean(), dtype=np.complex128)


def least_moved(number: int) -> list[str]:
    """Return the stable states of a sequence that need the least movement, or nearly the least."""
    moved = {state.word: movement(state.word) for state in states.folded(number) if state.stable}
    least = min(moved.values())
    return [word for word, moves in moved.items() if moves <= NEARLY * least]


def plots(measured: Measured) -> list[Plot]:
    """Draw the bars as in the benchmark, one picture per device."""
    made: list[Plot] = []
    for name, kind in KINDS.items():
        caption = (
            f"{device(kind)}: shares of releases with 95 % intervals. Below each bar is the chain "
            "of one release that ended so, with component 1 filled."
        )
        chart = experiment.draw_experiment(measured[name])
        made.append(Plot.of(f"figure-18{kind}", chart, caption))
    return made


FIGURE_18 = Reproduction(
    "figure-18",
    "Figure 18: fold probabilities by mode of release",
    "Where releases end",
    shows="How often each sequence folded into each of its shapes, or misfolded, in 100 free folds "
    "and 50 feeds out of a tube in either direction. The text does not give the numbers but "
    "describes them.",
    computed="As many simulated releases of the reconstructed sequences, with magnets as built, "
    "this project's solver and the spread of a release by hand: start angles, friction, masses, "
    "magnets and feed vary a little between releases. Done twice: with 0.6 T and the friction "
    "in the text, and with 1.2 T and little friction, because the text measures 0.6 T on the "
    "surface and says that the floor has low friction.",
    missing="The text does not give sequences, masses or spreads: they are "
    "reconstructed or assumed. The paper does not define least (lateral) movement. Here it is the "
    "root mean square movement of centres from a straight chain laid on the fold, and nearly "
    "equal movements count as equal.",
    measure=measure,
    tables=tables,
    claims=claims,
    plots=plots,
)
