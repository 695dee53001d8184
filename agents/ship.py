"""Make shipped policies of training runs: ``python -m agents.ship policies NAME RUN ...``.

``python -m agents.ship results NAME results.json ablation.json admission.json ...`` then writes
what `agents.evaluate NAME`, `agents.ablate NAME` and `agents.admission` found onto their card.
"""

import shutil
from collections import defaultdict
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.ablate import SEEING
from agents.admission.contestants import TRAINED
from agents.commands import reported_errors
from agents.evaluation.policies import policies_dir
from agents.evaluation.shipped import (
    AblationRow,
    AdmissionRow,
    Card,
    CardAblation,
    CardAdmission,
    CardError,
    CardResult,
    Training,
)
from agents.settings import load_settings
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from magfold_env.cli import options
from magfold_env.files import replacing
from magfold_env.scoring.results import Results, Row, View

app = options.Application(help=__doc__, no_args_is_help=True)
"""The command."""


def ship_policies(name: str, runs: list[Path], folder: Path) -> Card:
    """Write the policies of training runs and a card without results to `folder`.

    The set is called `name`, and the runs, finished, differ in nothing but the seed.

    Raises
    ------
    CardError
        If a run is not finished, or two differ in more than the seed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    policies: list[Training] = []
    settings: dict[str, Any] | None = None
    for number, run in enumerate(runs):
        info = RunInfo.read(run)
        if info is None or not info.finished:
            raise CardError(f"{run}: is not the folder of a finished training run")
        own = load_settings(run / "settings.yaml").model_dump(mode="json", exclude={"seed"})
        if settings not in (None, own):
            raise CardError(f"{run}: was trained with other settings than {runs[0]}")
        settings = own
        policy_files.load(run / "policy.safetensors")
        file = folder / f"{name}-{number}.safetensors"
        with replacing(file) as temporary:
            shutil.copyfile(run / "policy.safetensors", temporary)
        policies.append(Training(file=file.name, sha256=str(file_digest(str(file))), run=info))
    card = Card(name=name, settings=settings or {}, policies=tuple(policies))
    card.write(folder / f"{name}.json")
    return card


def with_results(card: Card, files: list[Path]) -> Card:
    """Return a card with the results of `agents.evaluate` in place of those that it had.

    Those of `agents.ablate` and `agents.admission` replace its ablations and admissions likewise;
    what there is no file of stays.

    Raises
    ------
    CardError
        If a file has no results of these policies.
    """
    found: dict[str, list[CardResult | CardAblation | CardAdmission]] = defaultdict(list)
    for file in files:
        try:
            results = Results.read(file, *_READERS)
            key, read = _READERS[results.view]
            found[key].append(read(card, results))
        except (OSError, ValueError, KeyError) as error:
            raise CardError(f"{file}: has no results of all of {card.name}: {error}") from None
    return card.model_copy(update={key: tuple(parts) for key, parts in found.items()})


def _result(card: Card, results: Results) -> CardResult:
    """Return which draws ended in each target, by policy of the card."""
    runs = {
        file.sha256: run
        for row in results.rows.values()
        for file, run in zip(row.files, row.runs, strict=True)
    }
    successes: dict[str, list[str]] = defaultdict(list)
    for run in [runs[policy.sha256] for policy in card.policies]:
        ends: dict[str, str] = defaultdict(str)
        for target, success in zip(run.task, run.success, strict=True):
            ends[str(target)] += success
        for target, letters in ends.items():
            successes[target].append(letters)
    return CardResult(
        env=results.env,
        seeds=results.seeds,
        physics=results.physics,
        successes={target: tuple(rows) for target, rows in successes.items()},
    )


def _ablation(card: Card, results: Results) -> CardAblation:
    """Return the rows of an ablation, and which policies of the card played."""
    rows = {
        name: AblationRow(
            success=row.success, score=row.score or 0.0, difference=row.figures["difference"]
        )
        for name, row in results.rows.items()
    }
    return CardAblation(
        env=results.env,
        seeds=results.seeds,
        physics=results.physics,
        policies=_seeds(card, results.rows[SEEING]),
        rows=rows,
    )


def _admission(card: Card, results: Results) -> CardAdmission:
    """Return what a track's admission found of the policies of the card."""
    rows = {
        name: AdmissionRow(
            success=row.success, score=row.score or 0.0, normalised=row.figures["normalised"]
        )
        for name, row in results.rows.items()
    }
    trained = results.rows[TRAINED]
    return CardAdmission(
        id=results.id,
        physics=results.physics,
        verdict=results.figures["verdict"],
        rows=rows,
        policies=_seeds(card, trained),
        successes=tuple(run.success for run in trained.runs),
    )


def _seeds(card: Card, row: Row) -> tuple[int, ...]:
    """Return the training seeds of the policies of the card that played a row."""
    seeds = {policy.sha256: policy.run.seed for policy in card.policies}
    return tuple(seeds[str(file.sha256)] for file in row.files)


_READERS: dict[View, Any] = {
    "evaluation": ("results", _result),
    "ablation": ("ablations", _ablation),
    "admission": ("admissions", _admission),
}
"""Where a view belongs on a card, and what it is there."""

Name = Annotated[str, typer.Argument(help="Name of the set.")]
Folder = Annotated[Path | None, typer.Option(help="Where it lies; configs/policies by default.")]


@app.command("policies")
def policies_command(
    name: Name,
    runs: Annotated[list[Path], typer.Argument(help="Folders of training runs, one a seed.")],
    folder: Folder = None,
) -> None:
    """Write the policies of training runs and a card."""
    with reported_errors(ValueError):
        _say(ship_policies(name, runs, folder or policies_dir()))


@app.command("results")
def results_command(
    name: Name,
    files: Annotated[
        list[Path],
        typer.Argument(help="What agents.evaluate, agents.ablate or agents.admission wrote."),
    ],
    folder: Folder = None,
) -> None:
    """Write results onto the card."""
    path = (folder or policies_dir()) / f"{name}.json"
    with reported_errors(ValueError):
        card = with_results(Card.read(path), files)
        card.write(path)
        _say(card)


def _say(card: Card) -> None:
    counts = {key: getattr(card, key) for key in ("policies", "results", "ablations", "admissions")}
    told = f"{card.name}: {', '.join(f'{len(each)} {name}' for name, each in counts.items())}"
    typer.echo(told, err=True)


if __name__ == "__main__":
    app()
