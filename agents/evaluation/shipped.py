"""Trained policies of the project, and the cards with their results.

`load_shipped("ppo-tube-feed")` loads one; in `agents.evaluate`, the name means the policies of all
its seeds. A set of policies in ``configs/policies`` consists of a file for each seed and a JSON
card with their training, checksums and results.
"""

import json
from pathlib import Path
from typing import Any, Self

import torch
from pydantic import ValidationError

from agents.evaluation import policies
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from magfold_env.files import write_text
from magfold_env.scene.base import FrozenModel
from magfold_env.scoring.results import Results, Row, View, one_line_lists


class CardError(ValueError):
    """A card that cannot be read, or that belongs to other policies."""


class Training(FrozenModel):
    """The origin of the policy of one seed."""

    file: str
    """Name of the file."""
    sha256: str
    """SHA-256 of the file."""
    run: RunInfo
    """Record of the training: commit, versions, seed, steps, seconds."""


class Card(FrozenModel):
    """The card of a set of shipped policies."""

    name: str
    """Name of the set."""
    settings: dict[str, Any]
    """Settings of the training, as in its YAML file, without the seed."""
    policies: tuple[Training, ...]
    """Policies, one per seed."""
    results: tuple[Results, ...] = ()
    """Results of `agents.evaluate` and `agents.ablate` in an environment, and of `agents.admission`
    on a track, with the episodes of these policies only."""

    def of(self, view: View) -> list[Results]:
        """Return the results of one of these commands."""
        return [each for each in self.results if each.view == view]

    def numbers(self, row: Row) -> list[int]:
        """Return the indices, from 0, of the policies of a row.

        Raises
        ------
        ValueError
            If a file of the row belongs to none of them.
        """
        return [[each.sha256 for each in self.policies].index(str(f.sha256)) for f in row.files]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a card.

        Raises
        ------
        CardError
            If it is damaged or belongs to other policies than those beside it.
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
    """Return the files of the policies called `name`, one per seed; see `shipped_card`."""
    return [policies.policies_dir() / policy.file for policy in shipped_card(name).policies]


def load_shipped(name: str, number: int = 0) -> policy_files.SavedPolicy:
    """Load a policy of the project: one seed of a set such as ``ppo-tube-feed``.

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
