"""Make a set of shipped policies from training runs: ``python -m agents.ship policies NAME RUN``.

``python -m agents.ship results NAME results.json ablation.json admission.json ...`` then adds the
results of `agents.evaluate NAME`, `agents.ablate NAME`, `agents.admission` and ``magfold score`` to
the set's card.
"""

import shutil
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.ablate import SEEING
from agents.admission.players import TRAINED
from agents.evaluation.policies import policies_dir
from agents.evaluation.shipped import Card, CardError, Training
from agents.settings import load_settings
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from magfold_env.cli import options
from magfold_env.files import replacing
from magfold_env.scoring.results import Results, Row, Run, View

VIEWS: tuple[View, ...] = ("evaluation", "ablation", "admission", "score")
"""The kinds of results that a card contains."""

app = options.application(help=__doc__, no_args_is_help=True)
"""The command."""


def ship_policies(name: str, runs: list[Path], folder: Path) -> Card:
    """Write the policies of training runs and a card without results to `folder`.

    `name` is the name of the set. The runs must be finished and differ only in the seed.

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
            raise CardError(f"{run}: was trained with settings other than those of {runs[0]}")
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
    """Return a card with new results; results of commands without a new file are kept.

    Raises
    ------
    CardError
        If a file has no results of the card's policies.
    """
    found: list[Results] = []
    for file in files:
        try:
            found.append(_own(card, Results.read(file, *VIEWS)))
        except (OSError, ValueError, LookupError, StopIteration) as error:
            raise CardError(f"{file}: has no results of all of {card.name}: {error}") from None
    views = {each.view for each in found}
    kept = [each for each in card.results if each.view not in views]
    return card.model_copy(update={"results": (*kept, *found)})


def _own(card: Card, results: Results) -> Results:
    """Return the results that a card stores, with only its own policies' success by episode."""
    if results.view == "score":
        (row,) = results.rows.values()
        card.numbers(row)
        return results
    rows = {name: row.model_copy(update={"runs": ()}) for name, row in results.rows.items()}
    if results.view == "evaluation":
        digests = [each.sha256 for each in card.policies]
        every = results.rows.values()
        own = next(row for row in every if [each.sha256 for each in row.files] == digests)
        name, rows = card.name, {card.name: Row(success=own.success, files=own.files)}
    else:
        name = TRAINED if results.view == "admission" else SEEING
        own = results.rows[name]
        card.numbers(own)
    runs = tuple(Run(success=each.success) for each in own.runs)
    rows[name] = rows[name].model_copy(update={"runs": runs})
    return results.model_copy(update={"rows": rows})


Name = Annotated[str, typer.Argument(help="Name of the set.")]
Folder = Annotated[
    Path | None, typer.Option(help="Folder of the set; configs/policies by default.")
]


@app.command("policies")
def policies_command(
    name: Name,
    runs: Annotated[list[Path], typer.Argument(help="Folders of training runs, one per seed.")],
    folder: Folder = None,
) -> None:
    """Write the policies of training runs and a card."""
    card = ship_policies(name, runs, folder or policies_dir())
    typer.echo(f"{name}: {len(card.policies)} policies", err=True)


@app.command("results")
def results_command(
    name: Name,
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Files of agents.evaluate, agents.ablate, agents.admission or magfold score."
        ),
    ],
    folder: Folder = None,
) -> None:
    """Add results to the card."""
    path = (folder or policies_dir()) / f"{name}.json"
    card = with_results(Card.read(path), files)
    card.write(path)
    typer.echo(f"{name}: {', '.join(each.view for each in card.results)}", err=True)


if __name__ == "__main__":
    app()
