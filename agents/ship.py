"""Make shipped policies of training runs: ``python -m agents.ship policies NAME RUN ...``.

``python -m agents.ship results NAME results.json ablation.json admission.json ...`` then writes
what `agents.evaluate NAME`, `agents.ablate NAME` and `agents.admission` found onto their card.
"""

import json
import shutil
from collections import defaultdict
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.ablate import FORMAT as ABLATION
from agents.admission import FORMAT as ADMISSION
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
from agents.settings import EnvSettings, load_settings
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from magfold_env.cli import options
from magfold_env.files import replacing

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
            content = json.loads(file.read_text(encoding="utf-8"))
            if content.get("format") == ADMISSION:
                found["admissions"].append(_admission(card, content))
                continue
            ablation = content.get("format") == ABLATION
            env = EnvSettings.model_validate(content["env"])
            shared = {
                "env": env.model_dump(mode="json", exclude_defaults=True),
                "seeds": content["seeds"],
                "physics": content["provenance"]["physics"],
            }
            if ablation:
                found["ablations"].append(CardAblation(**shared, **_ablation(card, content)))
            else:
                found["results"].append(CardResult(**shared, successes=_ends(card, content)))
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise CardError(f"{file}: has no results of all of {card.name}: {error!r}") from None
    return card.model_copy(update={key: tuple(parts) for key, parts in found.items()})


def _ends(card: Card, content: dict[str, Any]) -> dict[str, tuple[str, ...]]:
    """Return which draws ended in each target, by policy of the card."""
    runs = {
        each["sha256"]: episodes
        for method in content["methods"].values()
        for each, episodes in zip(method["policies"], method["runs"], strict=True)
    }
    successes: dict[str, list[str]] = defaultdict(list)
    for episodes in [runs[policy.sha256] for policy in card.policies]:
        ends: dict[str, str] = defaultdict(str)
        for episode in episodes:
            ends[episode["target"]] += str(int(episode["success"]))
        for target, letters in ends.items():
            successes[target].append(letters)
    return {target: tuple(rows) for target, rows in successes.items()}


def _admission(card: Card, content: dict[str, Any]) -> CardAdmission:
    """Return what a track's admission found of the policies of the card."""
    seeds = {policy.sha256: policy.run.seed for policy in card.policies}
    return CardAdmission(
        id=content["id"],
        physics=content["provenance"]["physics"],
        verdict=content["verdict"],
        rows={
            name: AdmissionRow(**{key: row[key] for key in AdmissionRow.model_fields})
            for name, row in content["rows"].items()
        },
        policies=tuple(seeds[each["sha256"]] for each in content["policies"][TRAINED]),
        successes=tuple(each["successes"] for each in content["policies"][TRAINED]),
    )


def _ablation(card: Card, content: dict[str, Any]) -> dict[str, Any]:
    """Return the rows of an ablation, and which policies of the card played."""
    seeds = {policy.sha256: policy.run.seed for policy in card.policies}
    return {
        "policies": [seeds[each["sha256"]] for each in content["policies"]],
        "rows": {name: AblationRow(**row) for name, row in content["rows"].items()},
    }


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
