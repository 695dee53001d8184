"""Trained policies that come with the project, and the cards that say what they are worth.

`load_shipped("ppo-tube-feed")` loads one; `agents.evaluate` takes the name for the policies of all
its seeds. A set of them lies in ``configs/policies``: a file for each seed and a card, JSON, with
their training, checksums and results.
"""

from pathlib import Path
from typing import Any, Self

import torch
from pydantic import BaseModel, ConfigDict, ValidationError

from agents.evaluation import policies
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from magfold_env.files import write_text


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


class _Played(_Part):
    """What was found in one environment."""

    env: dict[str, Any]
    """Settings of the environment that differ from its own."""
    seeds: tuple[int, ...]
    """Of the draws that every target was played on."""
    physics: str
    """Digest of the physics' sources."""


class CardResult(_Played):
    """What the policies scored in one environment."""

    successes: dict[str, tuple[str, ...]]
    """By target and policy which draws ended in it, a letter each: 1 or 0."""


class AblationRow(_Part):
    """What is left of the policies without a part of them."""

    success: tuple[float, float, float]
    """Share of the episodes, and its interval."""
    score: float
    """Mean over the episodes."""
    difference: tuple[float, float, float]
    """Success above that of the policies as they are, and its interval."""


class CardAblation(_Played):
    """What `agents.ablate` found in one environment."""

    policies: tuple[int, ...]
    """Training seeds of those that played."""
    rows: dict[str, AblationRow]
    """By what was taken away."""


class AdmissionRow(_Part):
    """How a contestant did where a task was to be admitted."""

    success: tuple[float, float, float]
    """Share of the episodes, and its interval."""
    score: float
    """Mean over the episodes."""
    normalised: float | None
    """The same, random actions 0 and the oracle 1."""


class CardAdmission(_Part):
    """What `agents.admission` found of a track and the policies."""

    id: str
    """Of the environment."""
    physics: str
    """Digest of the physics' sources."""
    verdict: str
    """Whether the track is admitted."""
    rows: dict[str, AdmissionRow]
    """By contestant."""
    policies: tuple[int, ...]
    """Training seeds of those that played."""
    successes: tuple[str, ...]
    """By policy which episodes succeeded, a letter each: 1 or 0."""


class Card(_Part):
    """What is known of a set of shipped policies."""

    name: str
    """Of the set."""
    settings: dict[str, Any]
    """Those of the training, as in its YAML file, but for the seed."""
    policies: tuple[Training, ...]
    """One a seed."""
    results: tuple[CardResult, ...] = ()
    """What was measured."""
    ablations: tuple[CardAblation, ...] = ()
    """What is left of it without parts of the policies."""
    admissions: tuple[CardAdmission, ...] = ()
    """What they are worth beside others on their track."""

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
        write_text(path, self.model_dump_json(indent=1) + "\n")


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
