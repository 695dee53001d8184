"""Write the tables of ``agents/SCOREBOARD.md`` from files: ``python -m agents.scoreboard``.

The files in ``agents/scores`` are the results of ``magfold score --json`` and `agents.admission`.
Each track has one admission, which supplies the rows of random actions, of the player that always
feeds forward, and of the oracle.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.admission.players import FORWARD, ORACLE, RANDOM
from agents.commands import run_command
from agents.evaluation.intervals import Estimate
from magfold_env.files import write_text
from magfold_env.scene import Problem, SceneError
from magfold_env.scoring.results import Results
from magfold_env.scoring.track import TRACKS

SCORES = Path(__file__).parent / "scores"
PAGE = Path(__file__).parent / "SCOREBOARD.md"

COLUMNS = (
    "", "success", "privileged", "failure floor", "score", "normalised", "episodes", "seed",
    "physics", "SHA-256",
)  # fmt: skip

SCALE = RANDOM, FORWARD, ORACLE
"""The rows of an admission that a table shows, for comparison with the scores."""


def page(folder: Path) -> str:
    """Return the scoreboard of a folder's files, below the text at the start of `PAGE`.

    Raises
    ------
    ValueError
        If there is no file, or if a file has no valid results or is a track's second admission.
    """
    files = sorted(folder.glob("*.json"))
    if not files:
        raise SceneError([Problem("scores", str(folder), "must be a folder with results (.json)")])
    admitted: dict[str, Results] = {}
    submitted: dict[str, list[Results]] = {name: [] for name in TRACKS}
    for path in files:
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
            submitted[name].append(results)
    parts = [PAGE.read_text(encoding="utf-8").partition("## `")[0].rstrip() + "\n"]
    for name, scores in submitted.items():
        parts.append("\n".join([f"## `{name}`", "", *_table(admitted.get(name), scores)]) + "\n")
    return "\n".join(parts)


def _table(admission: Results | None, scores: Sequence[Results]) -> Iterator[str]:
    """Yield the lines of a track's table: the rows in `SCALE`, then the scores, the best first."""
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
    success = [str(Estimate(*row.success)), "–"]
    privileged = name == ORACLE or row.kind == "actions"
    floor = normalised = "no oracle yet"
    if admission is not None:
        low, high = (admission.rows[each].score or 0.0 for each in (RANDOM, ORACLE))
        normalised = f"{(row.score - low) / (high - low):.3f}" if high > low else "–"
        value, least, most = admission.rows[ORACLE].success
        floor = str(Estimate(1.0 - value, 1.0 - most, 1.0 - least))
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


def main(
    *,
    scores: Annotated[Path, typer.Option(help="Folder of the result files.")] = SCORES,
    output: Annotated[Path, typer.Option(help="Page to write.")] = PAGE,
) -> None:
    """Write the scoreboard from the result files."""
    write_text(output, page(scores))
    typer.echo(f"written: {output}")


if __name__ == "__main__":
    run_command(main)
