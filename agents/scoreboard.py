"""Make ``agents/SCOREBOARD.md`` from files: ``python -m agents.scoreboard``.

The files in ``agents/scores`` are the results of ``magfold score --json`` and `agents.admission`;
of the latter, one per track, the rows random actions, always forward and oracle are used.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import typer

from agents.admission.contestants import FORWARD, ORACLE, RANDOM
from agents.commands import reported_errors, run_command
from agents.evaluation.intervals import Estimate
from magfold_env.files import write_text
from magfold_env.scene import Problem
from magfold_env.scene.errors import refuse
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


@dataclass(frozen=True)
class Row:
    """The results of a player in a track."""

    name: str
    success: Estimate
    score: float
    """Mean score."""
    episodes: int
    physics: str
    privileged: bool = False
    """Whether the player may know the draws or their hidden values."""
    seed: str = "admission"
    sha256: str = "–"

    @classmethod
    def of(cls, results: Results, name: str) -> Self:
        """Return the score of a row of results.

        Raises
        ------
        ValueError
            If there is no such row with a score.
        """
        row = results.rows.get(name)
        if row is None or row.score is None:
            refuse([Problem("rows", list(results.rows), f"must have {name}, with a score")])
            raise AssertionError
        own = cls(
            name,
            Estimate(*map(np.asarray, row.success)),
            row.score,
            len(row.runs[0].success) if row.runs else int(results.figures["episodes"]),
            results.physics,
            privileged=name == ORACLE or row.kind == "actions",
        )
        if results.view == "admission":
            return own
        return replace(own, seed=str(results.seed), sha256=f"`{str(row.files[0].sha256)[:12]}…`")


@dataclass(frozen=True)
class Track:
    """The results of a track."""

    rows: Sequence[Row]
    random: Row | None = None
    forward: Row | None = None
    oracle: Row | None = None

    @property
    def floor(self) -> str:
        """The failure floor as text."""
        if self.oracle is None:
            return "no oracle yet"
        value, low, high = self.oracle.success
        return str(Estimate(1.0 - value, 1.0 - high, 1.0 - low))

    def normalised(self, row: Row) -> str:
        """Return the normalised score as text."""
        if self.random is None or self.oracle is None:
            return "no oracle yet"
        low, high = self.random.score, self.oracle.score
        return f"{(row.score - low) / (high - low):.3f}" if high > low else "–"

    def table(self) -> Iterator[str]:
        """Yield the lines of the table: the rows that set the scale, then the others by score."""
        yield f"| {' | '.join(COLUMNS)} |"
        yield f"|{'---|' * len(COLUMNS)}"
        for name, row in ((RANDOM, self.random), (FORWARD, self.forward), (ORACLE, self.oracle)):
            if row is None:
                yield f"| {name} | {' | '.join(['not measured yet'] * 2)} |{' |' * 7}"
            else:
                yield self._line(row)
        for row in sorted(self.rows, key=lambda each: (-each.success.value, each.name)):
            yield self._line(row)

    def _line(self, row: Row) -> str:
        success = [str(row.success), "–"]
        cells = [
            row.name,
            *(reversed(success) if row.privileged else success),
            self.floor,
            f"{row.score:.3f}",
            self.normalised(row),
            str(row.episodes),
            row.seed,
            f"`{row.physics[:8]}`",
            row.sha256,
        ]
        return f"| {' | '.join(cells)} |"


def tracks(folder: Path) -> dict[str, Track]:
    """Return the results of every track in the files of a folder, by ID.

    Raises
    ------
    ValueError
        If a file is of an unknown kind, or is a second admission of a track.
    """
    admitted: dict[str, list[Row]] = {}
    handed_in: dict[str, list[Row]] = {name: [] for name in TRACKS}
    for path in sorted(folder.glob("*.json")):
        results = Results.read(path, "score", "admission")
        name, admission = results.id, results.view == "admission"
        if name not in TRACKS or (admission and name in admitted):
            allowed = f"must be one of {', '.join(TRACKS)}, one admission for each"
            raise ValueError(f"{path}: id: {name!r} is not allowed; {allowed}")
        try:
            rows = [
                Row.of(results, each)
                for each in ((RANDOM, FORWARD, ORACLE) if admission else results.rows)
            ]
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
        if admission:
            admitted[name] = rows
        else:
            handed_in[name] += rows
    return {name: Track(rows, *admitted.get(name, ())) for name, rows in handed_in.items()}


def page(folder: Path) -> str:
    """Return the scoreboard of the files in a folder.

    Raises
    ------
    ValueError
        If one of them is of an unknown kind.
    """
    parts = [HEAD]
    for name, track in tracks(folder).items():
        parts.append("\n".join([f"## `{name}`", "", *track.table()]) + "\n")
    return "\n".join(parts)


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
