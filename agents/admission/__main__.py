"""Test whether a task needs its physics: ``python -m agents.admission MagFold/UnknownFloor-v0``.

Players (`agents.admission.players`) play the same draws, which no search and no training uses, and
the rule (`agents.admission.rule`) sets the required differences. Differences that need trained
policies are measured only if such policies are given. If it is called again, the command
continues an interrupted run; with other policies or more episodes, it plays what is missing.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich import console, markdown

from agents.admission import players, rule
from agents.admission.players import (
    BLIND,
    OPEN_LOOP,
    ORACLE,
    TRAINED,
    AdmissionTrack,
    own_track,
)
from agents.admission.script import EFFORT
from agents.commands import Processes, progress_bar, run_command
from agents.evaluation import report
from agents.evaluation.episodes import Table
from agents.open_loops.search import Ranked, Search, rounds
from agents.training.folder import file_digest
from magfold_env.envs.tasks.draws import EVALUATION_VERSION
from magfold_env.files import physics_digest, write_text
from magfold_env.scoring.player import Player
from magfold_env.scoring.results import Run
from magfold_env.scoring.track import FEED_TRACKS

BLOCK = 50
"""Number of short episodes that a process plays in one job."""

Ranking = dict[int, list[Ranked]]
"""Each task's candidate open loops, the best first, by the task's number."""


def measure(
    track: AdmissionTrack,
    table: Table,
    efforts: tuple[Search, Search, Search],
    episodes: int,
    given: Mapping[str, Sequence[str]],
) -> tuple[dict[str, Any], Ranking]:
    """Play the episodes that the table's folder does not contain yet, and return all results.

    These are every player's success and score, (runs, episodes, 2), and the ranked candidates for
    open loops. `efforts` contains the efforts of the search for open loops, of the oracle's own
    search and of tuning the script; `given` maps each player's name to the paths of its policies.
    """
    searched, raced, tuning = efforts

    def row(
        name: str, count: int, play: Callable[..., list[Any]], own: tuple[Any, ...], block: int,
        **key: Any,
    ) -> list[Any]:  # fmt: skip
        def job(start: int, stop: int) -> tuple[Any, ...]:
            return track.env_id, track.tasks, play, *own, start, stop

        return table.row(name, count, job, _on_track, block, key)

    numbers = track.numbers
    ranked = row(OPEN_LOOP, len(numbers), players.search, (searched,), 1, search=searched)
    found = {
        number: [Ranked(*each) for each in own] for number, own in zip(numbers, ranked, strict=True)
    }
    best = {
        number: track.ranked(searched.candidates, number, own[: raced.candidates])
        for number, own in found.items()
    }
    first = {number: own[0] for number, own in best.items()}
    place = None
    if track.env_id in FEED_TRACKS:
        (place,) = row(players.SCRIPT, 1, players.tune_script, (tuning,), 1, search=tuning)
    simple = row(
        "simple", episodes, players.play_simple, (first, place), BLOCK,
        search=searched, script=tuning,
    )  # fmt: skip
    oracle = row(
        ORACLE, episodes, players.play_oracle, (best, raced.budget), 1,
        search=searched, race=raced,
    )  # fmt: skip
    ends: dict[str, Any] = {name: np.array([[each[name] for each in simple]]) for name in simple[0]}
    ends[ORACLE] = np.array([oracle])
    for kind, paths in given.items():
        runs: list[Any] = []
        for path in paths:
            digest = file_digest(path) or path
            name, own = f"{kind}-{digest[:16]}", (path, kind)
            runs.append(row(name, episodes, _play_policy, own, BLOCK, policy=digest, kind=kind))
        if runs:
            ends[kind] = np.array(runs)
    return ends, found


def _on_track(
    env_id: str, tasks: int | None, play: Callable[..., list[Any]], *job: Any
) -> list[Any]:
    return play(own_track(env_id, tasks), *job)


def _play_policy(track: AdmissionTrack, path: str, *job: Any) -> list[Any]:
    return players.play_policy(track, players.own_policy(path), *job)


def main(  # noqa: PLR0913 - one parameter per option
    env_id: Annotated[str, typer.Argument(metavar="ID", help="Environment.")],
    *,
    policy: Annotated[
        list[str] | None,
        typer.Option(help="A trained policy (.safetensors); repeat for other training seeds."),
    ] = None,
    blind: Annotated[
        list[str] | None,
        typer.Option(help="A policy of the same learner, trained equally long with motion hidden."),
    ] = None,
    tasks: Annotated[
        int | None,
        typer.Option(min=1, help="Largest number of tasks to play; all test tasks by default."),
    ] = None,
    episodes: Annotated[int, typer.Option(min=1, help="Episodes per row, over all tasks.")] = 2000,
    search: Annotated[
        tuple[int, int],
        typer.Option(help="Number of candidates for a task's open loop, and of episodes."),
    ] = (300, 1500),
    race: Annotated[
        tuple[int, int],
        typer.Option(
            help="Number of candidates that the oracle races per episode, and of copies it plays."
        ),
    ] = (64, 250),
    script: Annotated[
        tuple[int, int],
        typer.Option(help="Number of candidates for the script's settings, and of episodes."),
    ] = EFFORT,
    processes: Processes = 2,
    output: Annotated[
        Path | None, typer.Option(help="Folder of the results; runs/admission-ID by default.")
    ] = None,
) -> None:
    """Compare open loops, an oracle and trained policies; print whether the task is admitted."""
    folder = output or Path("runs") / f"admission-{env_id.rpartition('/')[2]}"
    efforts = searched, raced, tuning = Search(*search), Search(*race), Search(*script)
    seeing, unseeing = policy or [], blind or []
    given = {TRAINED: seeing, BLIND: unseeing}
    track = own_track(env_id, tasks)
    if raced.candidates > searched.candidates:
        raise ValueError(
            f"--race: {raced.candidates} open loops are not allowed; "
            f"must be among the {searched.candidates} of --search"
        )
    for effort in efforts:
        rounds(*effort)
    for path in (*seeing, *unseeing):
        saved = players.own_policy(path)
        Player(saved.policy, saved.shown, track.env_of(saved.policy.action_space))
    # Compile the engine before several processes need it.
    track.pool.follow(np.array(track.numbers[:1]), [0], [track.open_loops.fastest])
    key = {
        "id": env_id,
        "scene": track.setup.scene.model_dump(mode="json"),
        "tasks": [track.env.tasks[number].model_dump(mode="json") for number in track.numbers],
        "draws": EVALUATION_VERSION,
        "physics": physics_digest(),
    }
    with progress_bar() as bar:
        table = Table(bar, processes, folder, key)
        ends, found = measure(track, table, efforts, episodes, given)
    verdict = rule.judge({name: rule.by_chain(each, track.chains) for name, each in ends.items()})
    rows = {
        name: row.model_copy(
            update={
                "files": report.files_of(given.get(name, [])),
                "runs": tuple(Run.of(run[:, 0]) for run in ends[name]),
            }
        )
        for name, row in verdict.rows.items()
    }
    figures: dict[str, Any] = {
        "episodes": episodes,
        "search": searched._asdict(),
        "race": raced._asdict(),
        "open loops": {
            number: {"schedule": str(track.ranked(searched.candidates, number, own[:1])[0])}
            | own[0]._asdict()
            for number, own in found.items()
        },
        "script": tuning._asdict(),
        "chains": len(set(track.chains)),
        "rule": [
            {"line": str(line), "measured": line.measured, "holds": line.holds}
            for line in (verdict.tasks, *verdict.policy)
        ],
        "differences": verdict.differences,
        "verdict": verdict.decision,
    }
    results = report.made("admission", env_id, rows, figures=figures)
    text = rule.markdown(verdict)
    results.write(folder / "admission.json")
    write_text(folder / "admission.md", text)
    out = console.Console()
    out.print(markdown.Markdown(text))
    out.print(f"written: {folder / 'admission.json'}, {folder / 'admission.md'}")


if __name__ == "__main__":
    run_command(main)
