"""Policies that can be compared: random, trained ones, and choices made beforehand.

A choice is the magnets of every component and its speed; files hold those of searches.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
import torch
from pydantic import TypeAdapter, ValidationError

from agents.training import policy_files
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.files import configs_dir, write_text
from magfold_env.scene import Problem, errors
from magfold_env.scoring.player import Player
from magfold_env.scoring.shown import blind

FORMAT = "magfold_env choices 1"
BLIND = "blind:"
"""What the name of a policy that is to see no motion begins with."""


class Policy(Protocol):
    """Anything that chooses the next action."""

    def begin(self) -> None:
        """Forget all episodes before the next."""

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return the action for the present state of `env`; `rng` is the episode's own.

        Raises
        ------
        ValueError
            If the policy has nothing for the target, or knows other observations or actions.
        """
        ...


class RandomPolicy(Policy):
    """Draws every action evenly."""

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return a random action."""
        env.action_space.seed(int(rng.integers(2**31)))
        return env.action_space.sample()


class DesignPolicy(Policy):
    """Feeds the energy minimiser's design for the target at the speed that suits it best.

    It is the design that the reward is measured against: it does not look at the chain, and its
    speed is the nearest that the actions offer.
    """

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return the next component of the design."""
        baseline = env.baseline
        if baseline.sequence is None or baseline.speed is None:
            raise ValueError(f"target: {env.target!r} has no design to follow")
        return OpenLoop.at_one_speed(baseline.sequence, baseline.speed).action(env)


class TrainedPolicy(Policy):
    """A trained policy, which plays the most probable action, or draws it as in training.

    Of what is observed it sees what its file says.
    """

    def __init__(self, saved: policy_files.SavedPolicy, sampled: bool = False) -> None:
        self._saved = saved
        self._sampled = sampled
        self._player: Player | None = None

    @classmethod
    def load(cls, path: str | Path, sampled: bool = False, trust_pickle: bool = False) -> Self:
        """Read a policy that `agents.train` wrote, see `agents.training.policy_files.load`."""
        torch.set_num_threads(1)
        return cls(policy_files.load(path, trust_pickle), sampled)

    def begin(self) -> None:
        """Forget all episodes before the next."""
        self._player = None

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return the policy's action."""
        if self._player is None:
            self._player = Player(self._saved.policy, self._saved.shown, env, sampled=self._sampled)
        if self._sampled:
            torch.manual_seed(int(rng.integers(2**31)))
        if isinstance(observation, dict):
            batch: Any = {name: part[None] for name, part in observation.items()}
        else:
            batch = observation[None]
        return self._player.act(batch)[0]


class BlindPolicy(Policy):
    """Plays a policy, however it was trained, that is shown no motion.

    `magfold_env.scoring.shown.blind` says what that is.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = policy

    def begin(self) -> None:
        """Forget all episodes before the next."""
        self._policy.begin()

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return what the policy does without seeing the chain."""
        return self._policy.act(env, blind(env.layout, observation), rng)


def make_policy(name: str, trust_pickle: bool = False) -> Policy:
    """Return the policy called `name`.

    Parameters
    ----------
    name : str
        ``random``; ``minimiser``, the design that rewards are measured against; the path of
        choices that `agents.baselines` wrote (``.json``), or of a policy (``.safetensors``);
        ``blind:`` and one of these, which is then shown no motion.
    trust_pickle : bool
        Whether it may be a model as Stable-Baselines3 saves it, which can run any code.

    Raises
    ------
    ValueError
        If it is none of these, or the file is damaged or not one that is understood.
    """
    if name.startswith(BLIND):
        return BlindPolicy(make_policy(name.removeprefix(BLIND), trust_pickle))
    if name == "random":
        return RandomPolicy()
    if name == "minimiser":
        return DesignPolicy()
    path = Path(name)
    if not path.is_file():
        raise ValueError(none_called(name, ("random", "minimiser")))
    if path.suffix == ".json":
        return FrozenPolicy(read_choices(path))
    return TrainedPolicy.load(path, trust_pickle=trust_pickle)


def policies_dir() -> Path:
    """Return the folder of the sets of policies that come with the project."""
    return configs_dir() / "policies"


def shipped_names() -> list[str]:
    """Return the names of these sets."""
    return sorted(path.stem for path in policies_dir().glob("*.json"))


def as_given(policy: str) -> str:
    """Return how a user calls a policy: one that comes with the project by its name alone."""
    path = Path(policy)
    return path.stem if path.parent == policies_dir() else policy


def none_called(name: str, others: Iterable[str]) -> str:
    """Return which policies there are, beside `others`, and which may have been meant."""
    known = [*others, *shipped_names()]
    return (
        f"{name}: no such file; must be {', '.join(known)}, or a file of choices (.json) or of "
        f"a policy (.safetensors){errors.nearest(name, known)}"
    )


class OpenLoop(NamedTuple):
    """What an open loop decides."""

    sequence: tuple[str, ...]
    """The components, component 1 first."""
    speeds: tuple[float, ...]
    """Feed speed of each component [m/s], component 1 first."""

    @classmethod
    def at_one_speed(cls, sequence: tuple[str, ...], speed: float) -> "OpenLoop":
        """Return the choice that feeds a whole chain at one speed [m/s]."""
        return cls(sequence, (speed,) * len(sequence))

    @classmethod
    def of_actions(cls, env: FoldEnv[Any], actions: Sequence[Any]) -> "OpenLoop":
        """Return what is asked for by one action for all, or by one a component, 1 first."""
        read = [env.actions.decode(action) for action in actions]
        if env.actions.components > 1:
            sequence, speed = read[0]
            return cls.at_one_speed(sequence, float(speed))
        return cls(tuple(faces for (faces,), _ in read), tuple(float(speed) for _, speed in read))

    def as_played(self, env: FoldEnv[Any]) -> "OpenLoop":
        """Return the choice as the actions of `env` can express it.

        Speeds go to the nearest level, components to the nearest of the catalogue. Where a chain
        is chosen as a whole it has one speed, that of component 1.
        """
        encode = env.actions.encode
        if env.actions.components > 1:
            return self.of_actions(env, [encode(self.sequence, self.speeds[0])])
        return self.of_actions(env, [encode(*each) for each in zip(*self, strict=True)])

    def action(self, env: FoldEnv[Any]) -> Any:
        """Return the action with which the present episode of `env` goes on as chosen."""
        if env.actions.components > 1:
            return env.actions.encode(self.sequence, self.speeds[0])
        index = env.next_component
        return env.actions.encode(self.sequence[index], self.speeds[index])


class FrozenPolicy(Policy):
    """Plays a choice for each target, whatever the chain does."""

    def __init__(self, choices: Mapping[str, OpenLoop]) -> None:
        self._choices = choices

    def act(self, env: FoldEnv[Any], observation: Any, rng: object) -> Any:
        """Return the next action of what was chosen for the target of `env`."""
        if env.target not in self._choices:
            raise ValueError(
                f"target: {env.target!r} has no choice; must be one of {', '.join(self._choices)}"
            )
        return self._choices[env.target].action(env)


@dataclass(frozen=True)
class Chosen:
    """What a search chose for one target, and what speaks for it."""

    sequence: tuple[str, ...]
    speeds: tuple[float, ...]
    """As in `OpenLoop`, both."""
    calls: int
    """Physics calls that the search made."""
    successes: int
    """How many calls of this choice succeeded."""
    releases: int
    """How many calls of it there were: a flattering share, since it was chosen for it."""

    @property
    def choice(self) -> OpenLoop:
        """The choice alone."""
        return OpenLoop(self.sequence, self.speeds)


class ChoiceFile:
    """Choices by target, in a JSON file that is written anew with every one that is added.

    The `key` is everything that they depend on but their target, as values that JSON can hold.

    Raises
    ------
    ValueError
        If the file exists and is damaged, or was written with another key.
    """

    def __init__(self, path: Path, key: Mapping[str, Any]) -> None:
        self._path, self._key = path, json.loads(json.dumps(key))
        self.chosen: dict[str, Chosen] = {}
        if path.is_file():
            key, self.chosen = _read(path)
            for name, value in self._key.items():
                if (there := key.get(name)) != value:
                    raise ValueError(
                        f"{path}: was written by another search, with {name} {there!r}; "
                        f"must be {value!r}, or give another file"
                    )

    def add(self, target: str, chosen: Chosen) -> None:
        """Add what was chosen for a target."""
        self.chosen[target] = chosen
        choices = {word: asdict(each) for word, each in self.chosen.items()}
        content: dict[str, Any] = {"format": FORMAT, "key": self._key, "choices": choices}
        content["checksum"] = _checksum(content)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_text(self._path, json.dumps(content, indent=1) + "\n")


def read_choices(path: Path) -> dict[str, OpenLoop]:
    """Return the choices in a file, by target.

    Raises
    ------
    ValueError
        If it is no such file, or damaged.
    """
    return {target: each.choice for target, each in _read(path)[1].items()}


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Chosen]]:
    """Return what the choices in a file depend on, and the choices by target."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        checksum = content.pop("checksum")
        whole = content["format"] == FORMAT and checksum == _checksum(content)
        whole = whole and isinstance(content["key"], dict)
    except (OSError, ValueError, AttributeError, KeyError, TypeError, RecursionError):
        whole, content = False, {}
    if not whole:
        raise ValueError(f"{path}: holds no choices of agents.baselines, or is damaged")
    try:
        chosen = TypeAdapter(dict[str, Chosen]).validate_python(content.get("choices"))
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
        key = errors.dotted(("choices", *wrong["loc"]))
        raise ValueError(f"{path}: {Problem(key, wrong['input'], wrong['msg'])}") from None
    return content["key"], chosen


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
