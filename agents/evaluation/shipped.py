"""Trained policies that come with the project, and the cards that say what they are worth.

`load_shipped("ppo-tube-feed")` loads one; `agents.evaluate` takes the name for the policies of all
its seeds. A set of them lies in ``configs/policies``: a file for each seed and a card, JSON, with
their training, checksums and results.
"""

import json
from pathlib import Path
from typing import Any, Self

import torch
from pydantic import BaseModel, ConfigDict, ValidationError

from agents.evaluation import policies
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from magfold_env.files import write_text
from magfold_env.scoring.results import Results, Row, View, one_line_lists


class CardError(ValueError):
    """A card that cannot be read, or that is of other policies."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Training(_Part):
    """Where the policy of one seed comes from."""

    file: str
    """Name of the file."""
    sha256: str
    """Its checksum."""
    run: RunInfo
    """What was noted of the training: commit, versions, seed, steps, seconds."""


class Card(_Part):
    """What is known of a set of shipped policies."""

    name: str
    """Of the set."""
    settings: dict[str, Any]
    """Those of the training, as in its YAML file, but for the seed."""
    policies: tuple[Training, ...]
    """One a seed."""
    results: tuple[Results, ...] = ()
    """What was measured: what `agents.evaluate` and `agents.ablate` found in some environment, and
    `agents.admission` on a track, of which only the episodes of these policies are kept."""

    def of(self, view: View) -> list[Results]:
        """Return what one of these has found."""
        return [each for each in self.results if each.view == view]

    def numbers(self, row: Row) -> list[int]:
        """Return which of the policies are those of a row, from 0.

        Raises
        ------
        ValueError
            If a file of it is none of theirs.
        """
        return [[each.sha256 for each in self.policies].index(str(f.sha256)) for f in row.files]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a card.

        Raises
        ------
        CardError
            If it is damaged or of other policies than those that lie beside it.
        """
        try:
            card = cls.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            raise CardError(f"{path}: is not a card of policies: {error}") from None
        for policy in card.policies:
            if file_digest(str(path.parent / policy.file)) != policy.sha256:
                raise CardError(f"{path}: {policy.file} is missing, or is not the one it describes")
        return card

    def write(self, path: Path) -> None:
        """Write the card to `path`."""
        whole = self.model_dump(mode="json", exclude={"results"})
        results = [each.model_dump(mode="json", exclude_defaults=True) for each in self.results]
        write_text(path, one_line_lists(json.dumps(whole | {"results": results}, indent=1)) + "\n")


def shipped_card(name: str) -> Card:
    """Return the card of the policies called `name`.

    Raises
    ------
    ValueError
        If there are none, or they are damaged.
    """
    if name not in policies.shipped_names():
        known = ", ".join(policies.shipped_names())
        raise ValueError(f"{name}: no such policies; must be one of {known}")
    return Card.read(policies.policies_dir() / f"{name}.json")


def shipped_files(name: str) -> list[Path]:
    """Return the files of the policies called `name`, one a seed; see `shipped_card`."""
    return [policies.policies_dir() / policy.file for policy in shipped_card(name).policies]


def load_shipped(name: str, number: int = 0) -> policy_files.SavedPolicy:
    """Load a policy that comes with the project: of a set such as ``ppo-tube-feed``, one seed.

    Raises
    ------
    ValueError
        If there is no such policy, or its file is damaged.
    """
    files = shipped_files(name)
    if not 0 <= number < len(files):
        raise ValueError(f"number: {number} is not allowed; must be 0 to {len(files) - 1}")
    torch.set_num_threads(1)
    return policy_files.load(files[number])
