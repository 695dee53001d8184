"""Whether a task needs its physics: ``python -m agents.admission MagFold/UnknownFloor-v0``.

Contestants (`agents.admission.contestants`) play the same draws, which no search and no training
uses, and the rule (`agents.admission.rule`) sets the required differences. Lines of the rule that
need trained policies are measured if these are given. An interrupted command continues when it is
called again; with other policies or more episodes, it plays the missing episodes.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich import console, markdown, progress

from agents.admission import contestants, rule
from agents.admission.contestants import (
    BLIND,
    DRAWN,
    FROZEN,
    OPEN_LOOP,
    ORACLE,
    SAME_DRAW,
    SIMPLE,
    TRAINED,
    Arena,
    own_arena,
)
from agents.commands import progress_bar, reported_errors, run_command
from agents.evaluation.episodes import Table
from agents.evaluation.report import files_of, numbers
from agents.open_loops.search import Ranked, Search, rounds
from agents.training.folder import file_digest, provenance
from magfold_env.envs.tasks.draws import EVALUATION_VERSION
from magfold_env.files import physics_digest, write_text
from magfold_env.scoring.player import Player
from magfold_env.scoring.results import Results, Run

BLOCK = 50
"""Episodes of a job of short episodes."""


class Contest:
    """Plays the episodes that its folder does not contain yet, on several processes."""

    def __init__(self, arena: Arena, processes: int, folder: Path, bar: progress.Progress) -> None:
        self._arena, self._given = arena, (arena.env_id, arena.tasks)
        key = {
            "id": arena.env_id,
            "scene": arena.world.scene.model_dump(mode="json"),
            "tasks": [arena.env.tasks[number].model_dump(mode="json") for number in arena.numbers],
            "draws": EVALUATION_VERSION,
            "physics": physics_digest(),
        }
        self._table = Table(bar, processes, folder, key)

    def _row(
        self,
        name: str,
        count: int,
        play: Callable[..., list[Any]],
        given: Sequence[Any],
        key: dict[str, Any],
        block: int = 1,
    ) -> list[Any]:
        """Return a row of what `play` returns for an arena, what is given, and a first and last."""

        def job(start: int, stop: int) -> tuple[Any, ...]:
            return *self._given, play, *given, start, stop

        return self._table.row(name, count, job, _in_arena, block, key)

    def search(self, effort: Search) -> dict[int, list[Ranked]]:
        """Return the candidates of every task, by number, the best first."""
        numbers = self._arena.numbers
        key = {"search": effort}
        found = self._row(OPEN_LOOP, len(numbers), contestants.search, (effort,), key)
        return {
            number: [Ranked(*each) for each in ranked]
            for number, ranked in zip(numbers, found, strict=True)
        }

    def play(
        self, best: dict[int, list[Any]], searched: Search, raced: Search, episodes: int
    ) -> dict[str, Any]:
        """Return success and score of all untrained contestants, (1, episodes, 2).

        `best` contains the best candidates of every task, by number, as many as the oracle races;
        the first is the open loop.
        """
        key: dict[str, Any] = {"search": searched}
        first = {number: ranked[0] for number, ranked in best.items()}
        simple = self._row("simple", episodes, contestants.play_simple, (first,), key, BLOCK)
        oracle = self._row(
            ORACLE, episodes, contestants.play_oracle, (best, raced.budget), key | {"race": raced}
        )
        tables = (SIMPLE, simple), ((ORACLE, SAME_DRAW), oracle)
        return {
            name: np.array(played)[None, :, place]
            for names, played in tables
            for place, name in enumerate(names)
        }

    def play_policies(self, paths: Sequence[str], kind: str, episodes: int) -> Any:
        """Return success and score of policies, (policies, episodes, 2)."""
        runs: list[Any] = []
        for path in paths:
            digest = file_digest(path) or path
            name, key = f"{kind}-{digest[:16]}", {"policy": digest, "kind": kind}
            runs.append(self._row(name, episodes, _play_policy, (path, kind), key, BLOCK))
        return np.array(runs)


def _in_arena(env_id: str, tasks: int, play: Callable[..., list[Any]], *job: Any) -> list[Any]:
    return play(own_arena(env_id, tasks), *job)


def _play_policy(arena: Arena, path: str, *job: Any) -> list[Any]:
    return contestants.play_policy(arena, contestants.own_policy(path), *job)


def main(  # noqa: PLR0913 - one parameter an option
    env_id: Annotated[str, typer.Argument(metavar="ID", help="The environment.")],
    *,
    policy: Annotated[
        list[str] | None,
        typer.Option(help="A trained policy (.safetensors); repeat for other training seeds."),
    ] = None,
    blind: Annotated[
        list[str] | None,
        typer.Option(help="A policy of the same learner, trained equally long without motion."),
    ] = None,
    tasks: Annotated[int, typer.Option(min=1, max=24, help="Tasks that are played.")] = 24,
    episodes: Annotated[int, typer.Option(min=1, help="Episodes per row, over all tasks.")] = 1000,
    search: Annotated[
        tuple[int, int],
        typer.Option(help="Number of candidates for a task's open loop, and of their episodes."),
    ] = (1000, 6000),
    race: Annotated[
        tuple[int, int],
        typer.Option(
            help="Number of candidates that the oracle tries for an episode, and of copies."
        ),
    ] = (64, 250),
    processes: Annotated[int, typer.Option(min=1, help="Episodes played at a time.")] = 2,
    output: Annotated[
        Path | None, typer.Option(help="Folder of the results; runs/admission-ID by default.")
    ] = None,
) -> None:
    """Compare open loops, an oracle and trained policies, and print if the task is admitted."""
    folder = output or Path("runs") / f"admission-{env_id.rpartition('/')[2]}"
    searched, raced = Search(*search), Search(*race)
    seeing, unseeing = policy or [], blind or []
    given = {TRAINED: seeing, DRAWN: seeing, FROZEN: seeing, BLIND: unseeing}
    with reported_errors(ValueError):
        arena = own_arena(env_id, tasks)
        if raced.candidates > searched.candidates:
            raise ValueError(
                f"--race: {raced.candidates} open loops are not allowed; "
                f"must be among the {searched.candidates} of --search"
            )
        for effort in (searched, raced):
            rounds(*effort)
        for path in (*seeing, *unseeing):
            saved = contestants.own_policy(path)
            Player(saved.policy, saved.shown, arena.env_of(saved.policy.action_space))
        # The engine is compiled before several processes work.
        arena.field.follow(np.array(arena.numbers[:1]), [0], [arena.open_loops.fastest])
        with progress_bar() as bar:
            contest = Contest(arena, processes, folder, bar)
            found = contest.search(searched)
            best = {
                number: arena.ranked(searched.candidates, number, ranked[: raced.candidates])
                for number, ranked in found.items()
            }
            ends = contest.play(best, searched, raced, episodes)
            for kind, paths in given.items():
                if paths:
                    ends[kind] = contest.play_policies(paths, kind, episodes)
    verdict = rule.judge(ends)
    rows = {
        name: row.model_copy(
            update={
                "files": files_of(given.get(name, [])),
                "runs": tuple(Run.of(run[:, 0]) for run in ends[name]),
                "figures": row.figures | {"by task": rule.by_task(ends[name], arena.numbers)},
            }
        )
        for name, row in verdict.rows.items()
    }
    figures = {
        "episodes": episodes,
        "search": searched._asdict(),
        "race": raced._asdict(),
        "open loops": {
            number: {"schedule": str(best[number][0]), **ranked[0]._asdict()}
            for number, ranked in found.items()
        },
        "rule": [
            {
                "line": str(line),
                "measured": line.measured and numbers(line.measured),
                "holds": line.holds,
            }
            for line in verdict.lines
        ],
        "headroom": verdict.headroom and numbers(verdict.headroom),
        "verdict": verdict.said,
    }
    results = Results(
        view="admission",
        id=env_id,
        draws=EVALUATION_VERSION,
        physics=physics_digest(),
        provenance=provenance(),
        rows=rows,
        figures=figures,
    )
    text = rule.markdown(verdict)
    results.write(folder / "admission.json")
    write_text(folder / "admission.md", text)
    out = console.Console()
    out.print(markdown.Markdown(text))
    out.print(f"written: {folder / 'admission.json'}, {folder / 'admission.md'}")


if __name__ == "__main__":
    run_command(main)
