"""Trained policies that the project ships, and the cards with their results.

`load_shipped("ppo-tube-feed")` loads one, and so does `load_shipped(env)`; in `agents.evaluate`,
the name stands for the policies of all seeds. A set of policies in ``configs/policies`` consists of
a file for each seed and a JSON card, which records their training, checksums and results.
"""

import json
from pathlib import Path
from typing import Any, Self

import gymnasium
import torch
from pydantic import ValidationError

from agents.evaluation import policies
from agents.settings import EnvSettings
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from magfold_env.envs import ENTRY_POINTS
from magfold_env.envs.tasks.setup import RewardOptions
from magfold_env.files import write_text
from magfold_env.scene.base import FrozenModel
from magfold_env.scoring import policy_file
from magfold_env.scoring.results import Results, Row, View, one_line_lists


class CardError(ValueError):
    """A card that cannot be read, or that does not belong to the policies beside it."""


class Training(FrozenModel):
    """The origin of one seed's policy."""

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
    """Training settings, as in their YAML file, without the seed."""
    policies: tuple[Training, ...]
    """Policies, one per seed."""
    results: tuple[Results, ...] = ()
    """Results of `agents.evaluate` and `agents.ablate` in an environment, and of `agents.admission`
    and ``magfold score`` on a track, with the episodes of these policies only."""

    def of(self, view: View) -> list[Results]:
        """Return the results of one kind, such as "ablation"; one command wrote each of them."""
        return [each for each in self.results if each.view == view]

    @property
    def env(self) -> EnvSettings:
        """The environment in which the policies were trained."""
        return EnvSettings.model_validate(self.settings["env"])

    def numbers(self, row: Row) -> list[int]:
        """Return the indices, from 0, of the policies of a row.

        Raises
        ------
        ValueError
            If a file of the row belongs to none of the card's policies.
        """
        return [[each.sha256 for each in self.policies].index(str(f.sha256)) for f in row.files]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a card.

        Raises
        ------
        CardError
            If the card is damaged, or belongs to policies other than those beside it.
        """
        try:
            card = cls.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            raise CardError(f"{path}: is not a card of policies: {error}") from None
        for policy in card.policies:
            if file_digest(str(path.parent / policy.file)) != policy.sha256:
                raise CardError(f"{path}: {policy.file} is missing, or does not match the card")
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
        If there are no such policies, or they are damaged.
    """
    if name not in policies.shipped_names():
        known = ", ".join(policies.shipped_names())
        raise ValueError(f"{name}: no such policies; must be one of {known}")
    return Card.read(policies.policies_dir() / f"{name}.json")


def shipped_files(name: str) -> list[Path]:
    """Return the files of the policies called `name`, one per seed; see `shipped_card`."""
    return [policies.policies_dir() / policy.file for policy in shipped_card(name).policies]


def load_shipped(
    name: str | gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any], number: int = 0
) -> policy_files.SavedPolicy:
    """Load one of the project's policies: one seed of a set such as ``ppo-tube-feed``.

    Parameters
    ----------
    name : str or environment
        Name of the set, or a single or vector environment whose id and spaces fit one set only.
    number : int
        Number of the seed, from 0.

    Raises
    ------
    ValueError
        If there is no such policy, if its file is damaged, or if none or several sets fit an
        environment.
    """
    files = shipped_files(name if isinstance(name, str) else _fitting(name.unwrapped))
    if not 0 <= number < len(files):
        raise ValueError(f"number: {number} is not allowed; must be 0 to {len(files) - 1}")
    torch.set_num_threads(1)
    return policy_files.load(files[number])


def _fitting(env: Any) -> str:
    """Return the name of the set of policies that fits an environment or a vector environment."""
    one = getattr(env, "template", env)
    place = f"{type(one).__module__}:{type(one).__name__}"
    ids = [env_id for env_id, entry_point in ENTRY_POINTS.items() if entry_point == place]
    if env.spec is not None:
        ids = [env.spec.id]
    cards = [shipped_card(name) for name in policies.shipped_names()]
    trained = [card for card in cards if card.env.id in ids]
    spaces = one.observation_space, one.action_space
    fitting = [card.name for card in trained if _spaces(card) == spaces]
    if len(fitting) == 1:
        return fitting[0]
    wanted = fitting or [f"{_made(card.env)} for {card.name}" for card in trained]
    allowed = " or ".join(wanted) or f"one of {', '.join(card.name for card in cards)}"
    raise ValueError(f"name: {env} is not allowed; must be {allowed}")


def _spaces(card: Card) -> tuple[Any, Any]:
    """Return the spaces of the observations that a card's policies read and of their actions."""
    own = policy_file.read(policies.policies_dir() / card.policies[0].file).settings
    return own.observations.space(), own.actions.space()


def _made(env: EnvSettings) -> str:
    """Return code that makes an environment, with the options that may change its spaces."""
    aside = {"id", "randomisation", *RewardOptions.__annotations__}
    given = env.model_dump(exclude=aside, exclude_none=True)
    told = [repr(env.id), *(f"{key}={value!r}" for key, value in given.items())]
    return f"gymnasium.make({', '.join(told)})"
