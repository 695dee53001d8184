"""Make ``agents/SCOREBOARD.md`` from files: ``python -m agents.scoreboard``.

The files in ``agents/scores`` are the results of ``magfold score --json`` and `agents.admission`;
of the latter, one per track, the rows random actions, always forward and oracle are used.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from agents.admission.contestants import FORWARD, ORACLE, RANDOM
from agents.commands import reported_errors, run_command
from agents.evaluation.intervals import Estimate
from magfold_env.files import write_text
from magfold_env.scene import Problem
from magfold_env.scoring.results import Results
from magfold_env.scoring.track import TRACKS

SCORES = Path(__file__).parent / "scores"
PAGE = Path(__file__).parent / "SCOREBOARD.md"

HEAD = """# Scoreboard

Made from the files in `agents/scores` by `python -m agents.scoreboard`; not to be edited.

What is handed in is a file: a policy as `agents.train` writes it, weights and JSON, or actions
chosen beforehand, JSON. Nothing in it is run as code or unpickled.

1. Make the file, and try it: `magfold score FILE --env ID` plays 1,000 episodes of seed 0 in at
   most ten minutes on two cores. Networks are hidden layers with `tanh` or `relu` on observations
   as they are (`features: chain`), up to 64 of them, of PPO, MaskablePPO, RecurrentPPO, SAC or
   TQC.
2. Hand in the SHA-256 of the file with the track's ID, in an issue.
3. The maintainers close the list and announce a seed only afterwards: a number that nobody could
   know before, such as the first 15 hexadecimal digits, as a number, of the first output of a
   public randomness beacon after a time named beforehand.
4. Play it: `magfold score FILE --env ID --seed SEED --json NAME.json`, and hand in both files. The
   maintainers play it again: the file must have that SHA-256, and what they find must lie within
   the interval, since processors round the sums of a network differently.

Actions may be chosen with knowledge of the draws, of any seed, and stand in the privileged column,
as the oracle does: `magfold_env.scoring.action_file` has the format, and
`magfold_env.scoring.score.track_of` gives the draws. Their replay is the same bit for bit, scores
and energies, where the physics is.

Success is the share of episodes that reach what is wanted, with Wilson's 95 % interval, on at most
24 tasks in turn. The failure floor is the share in which the oracle fails, which knows the hidden
physics and not the start ([how](../docs/evaluation.md#admission)): to fail less often is luck, or
better play than its schedules. Normalised is the mean score where random actions have 0 and the
oracle has 1. Physics is a hash of its sources: scores of two of them are not of one task. The rows
of random actions, always forward and the oracle are of physics 9, those of the policies of 10: of
1,000 episodes the policies now reach what is wanted in 1 to 14 more.
"""

COLUMNS = (
    "", "success", "privileged", "failure floor", "score", "normalised", "episodes", "seed",
    "physics", "SHA-256",
)  # fmt: skip


SCALE = RANDOM, FORWARD, ORACLE
"""What is taken of an admission."""


def page(folder: Path) -> str:
    """Return the scoreboard of the files in a folder.

    Raises
    ------
    ValueError
        If one of them is not understood, or is a track's second admission.
    """
    admitted: dict[str, Results] = {}
    handed_in: dict[str, list[Results]] = {name: [] for name in TRACKS}
    for path in sorted(folder.glob("*.json")):
        results = Results.read(path, "score", "admission")
        name, admission = results.id, results.view == "admission"
        if name not in TRACKS or (admission and name in admitted):
            allowed = f"must be one of {', '.join(TRACKS)}, one admission for each"
            raise ValueError(f"{path}: id: {name!r} is not allowed; {allowed}")
        for each in SCALE if admission else results.rows:
            if each not in results.rows or results.rows[each].score is None:
                allowed = f"must have {each}, with a score"
                raise ValueError(f"{path}: {Problem('rows', list(results.rows), allowed)}")
        if admission:
            admitted[name] = results
        else:
            handed_in[name].append(results)
    parts = [HEAD]
    for name, scores in handed_in.items():
        parts.append("\n".join([f"## `{name}`", "", *_table(admitted.get(name), scores)]) + "\n")
    return "\n".join(parts)


def _table(admission: Results | None, scores: Sequence[Results]) -> Iterator[str]:
    """Yield the lines of a track's table: what sets the scale, then the best first."""
    yield f"| {' | '.join(COLUMNS)} |"
    yield f"|{'---|' * len(COLUMNS)}"
    for name in SCALE:
        if admission is None:
            yield f"| {name} | {' | '.join(['not measured yet'] * 2)} |{' |' * 7}"
        else:
            yield _line(admission, name, admission)
    entries = ((name, each) for each in scores for name in each.rows)
    for name, each in sorted(entries, key=lambda e: (-e[1].rows[e[0]].success[0], e[0])):
        yield _line(each, name, admission)


def _line(results: Results, name: str, admission: Results | None) -> str:
    row: Any = results.rows[name]
    success = [_estimate(*row.success), "–"]
    privileged = name == ORACLE or row.kind == "actions"
    floor = normalised = "no oracle yet"
    if admission is not None:
        low, high = (admission.rows[each].score or 0.0 for each in (RANDOM, ORACLE))
        normalised = f"{(row.score - low) / (high - low):.3f}" if high > low else "–"
        value, least, most = admission.rows[ORACLE].success
        floor = _estimate(1.0 - value, 1.0 - most, 1.0 - least)
    seed, sha256 = "admission", "–"
    if results.view == "score":
        seed, sha256 = str(results.seed), f"`{row.files[0].sha256[:12]}…`"
    cells = [
        name,
        *(reversed(success) if privileged else success),
        floor,
        f"{row.score:.3f}",
        normalised,
        str(len(row.runs[0].success) if row.runs else results.figures["episodes"]),
        seed,
        f"`{results.physics[:8]}`",
        sha256,
    ]
    return f"| {' | '.join(cells)} |"


def _estimate(*numbers: float) -> str:
    return str(Estimate(*map(np.asarray, numbers)))


def main(
    *,
    scores: Annotated[Path, typer.Option(help="Folder of the files.")] = SCORES,
    output: Annotated[Path, typer.Option(help="The page.")] = PAGE,
) -> None:
    """Write the scoreboard from the files."""
    with reported_errors(ValueError, OSError):
        write_text(output, page(scores))
    typer.echo(f"written: {output}")


if __name__ == "__main__":
    run_command(main)
