"""Policies for comparison: random actions, trained policies, and choices made in advance.

A choice contains every component's magnets and speed; files store the choices of searches.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from pydantic import TypeAdapter, ValidationError

from agents.training import policy_files
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.files import configs_dir, reading_json, write_text
from magfold_env.scene import Problem, errors
from magfold_env.scoring.player import Player

FORMAT = "magfold_env choices 1"
NO_MOTION, BLIND = "no-motion:", "blind:"
"""Prefixes of the names of policies that see no motion; the second is an older form."""


class OpenLoop(NamedTuple):
    """The components and feed speeds of an open-loop policy, all chosen in advance."""

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
        """Return the choice that actions express, one for the chain or one per component."""
        read = [env.actions.decode(action) for action in actions]
        if env.actions.components > 1:
            sequence, speed = read[0]
            return cls.at_one_speed(sequence, float(speed))
        return cls(tuple(faces for (faces,), _ in read), tuple(float(speed) for _, speed in read))

    def as_played(self, env: FoldEnv[Any]) -> "OpenLoop":
        """Return the choice as the actions of `env` can express it.

        Speeds are rounded to the nearest level, and components to the nearest ones in the
        catalogue. A chain that is chosen as a whole has one speed: that of component 1.
        """
        encode = env.actions.encode
        if env.actions.components > 1:
            return self.of_actions(env, [encode(self.sequence, self.speeds[0])])
        return self.of_actions(env, [encode(*each) for each in zip(*self, strict=True)])

    def action(self, env: FoldEnv[Any], episodes: Any, row: int) -> Any:
        """Return the next action of an episode that follows this choice; `row` is its row."""
        if env.actions.components > 1:
            return env.actions.encode(self.sequence, self.speeds[0])
        arrays = episodes.arrays
        index = arrays.order(row)[int(arrays.fed[row])]
        return env.actions.encode(self.sequence[index], self.speeds[index])


Act = Callable[[Any, Ints], Sequence[Any]]
"""A function that maps episodes and some of their rows to one action per row."""

Policy = Callable[[FoldEnv[Any], Sequence[int], Sequence[np.random.Generator]], Act]
"""A function that begins episodes of an environment and returns the plan for their rows.

The other arguments are the numbers of the targets and the random generators of the episodes. It
raises a `ValueError` if it lacks a target or has other observations or actions."""


def at_random(env: FoldEnv[Any], numbers: object, rngs: Sequence[np.random.Generator]) -> Act:
    """Return a plan that draws every action uniformly."""
    space = env.action_space

    def act(_: object, rows: Ints) -> Sequence[Any]:
        found: list[Any] = []
        for row in rows.tolist():
            space.seed(int(rngs[row].integers(2**31)))
            found.append(space.sample())
        return found

    return act


def designs(env: FoldEnv[Any], numbers: Sequence[int], rngs: object) -> Act:
    """Return a plan that feeds the energy minimiser's design for each target at its best speed.

    The reward's baseline uses the same design. The plan ignores observations; it feeds at the
    available speed that is nearest to the best one.
    """
    found: dict[str, OpenLoop] = {}
    for target in {env.targets[number] for number in numbers}:
        baseline = env.baseline_of(target)
        if baseline.sequence is None or baseline.speed is None:
            raise ValueError(f"target: {target!r} has no design to follow")
        found[target] = OpenLoop.at_one_speed(baseline.sequence, baseline.speed)
    return chosen(found)(env, numbers, ())


def chosen(choices: Mapping[str, OpenLoop]) -> Policy:
    """Return a policy that follows one choice per target, regardless of the chain's motion."""

    def begin(env: FoldEnv[Any], numbers: Sequence[int], rngs: object) -> Act:
        targets = [env.targets[number] for number in numbers]
        if missing := [target for target in targets if target not in choices]:
            allowed = f"must be one of {', '.join(choices)}"
            raise ValueError(f"target: {missing[0]!r} has no choice; {allowed}")
        own = [choices[target] for target in targets]
        return lambda episodes, rows: [own[row].action(env, episodes, row) for row in rows.tolist()]

    return begin


def trained(saved: policy_files.SavedPolicy, no_motion: bool = False) -> Policy:
    """Return a policy that plays a trained policy's most probable actions.

    It reads observations in the form that its file defines; `no_motion` removes motion from them in
    any case (see `magfold_env.scoring.observation_view.blind`).
    """
    shown = saved.shown.model_copy(update={"blind": saved.shown.blind or no_motion})

    def begin(env: FoldEnv[Any], numbers: Sequence[int], rngs: object) -> Act:
        player = Player(saved.policy, shown, env, len(numbers))
        return lambda episodes, rows: player.act(episodes.observe())[rows]

    return begin


def at_speed(policy: Policy, speed: float | None) -> Policy:
    """Return `policy` with its speeds replaced by one speed [m/s], or by random ones if None."""

    def begin(
        env: FoldEnv[Any], numbers: Sequence[int], rngs: Sequence[np.random.Generator]
    ) -> Act:
        act = policy(env, numbers, rngs)

        def other(episodes: Any, rows: Ints) -> Sequence[Any]:
            found: list[Any] = []
            for row, action in zip(rows.tolist(), act(episodes, rows), strict=True):
                faces, _ = env.actions.decode(action)
                fed = float(rngs[row].choice(env.actions.speeds)) if speed is None else speed
                found.append(env.actions.encode(faces, fed))
            return found

        return other

    return begin


def make_policy(name: str) -> Policy:
    """Return the policy called `name`.

    The name is ``random``; ``minimiser``, the design against which rewards are measured; the path
    of choices that `agents.baselines` wrote (``.json``), or of a policy (``.safetensors``); or
    ``no-motion:`` followed by one of these, which then sees no motion.

    Raises
    ------
    ValueError
        If the name is none of these, or the file is damaged or unsupported.
    """
    no_motion = name.startswith((NO_MOTION, BLIND))
    path = name.partition(":")[2] if no_motion else name
    if path == "random":
        return at_random
    if path == "minimiser":
        return designs
    if not Path(path).is_file():
        known = ["random", "minimiser", *shipped_names()]
        raise ValueError(
            f"{path}: no such file; must be {', '.join(known)}, or a file of choices (.json) or of "
            f"a policy (.safetensors){errors.nearest(path, known)}"
        )
    if Path(path).suffix == ".json":
        return chosen(read_choices(Path(path)))
    torch.set_num_threads(1)
    return trained(policy_files.load(path), no_motion)


def policies_dir() -> Path:
    """Return the folder of the project's sets of policies."""
    return configs_dir() / "policies"


def shipped_names() -> list[str]:
    """Return the names of the project's sets of policies."""
    return sorted(path.stem for path in policies_dir().glob("*.json"))


class Chosen(NamedTuple):
    """A search's choice for one target, with the record of the choice."""

    sequence: tuple[str, ...]
    speeds: tuple[float, ...]
    """Sequence and speeds, as in `OpenLoop`."""
    calls: int
    """Number of physics calls of the search."""
    successes: int
    """Number of successful calls of this choice."""
    releases: int
    """Number of calls of this choice; the share of successes is optimistic, because the search
    selected the choice by it."""


class ChoiceFile:
    """Choices by target, in a JSON file that is rewritten with every new choice.

    `key` contains everything on which the choices depend, except their target, as JSON values.

    Raises
    ------
    ValueError
        If the file exists and is damaged or has another key.
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
        """Add the choice for a target."""
        self.chosen[target] = chosen
        choices = {word: each._asdict() for word, each in self.chosen.items()}
        content: dict[str, Any] = {"format": FORMAT, "key": self._key, "choices": choices}
        content["checksum"] = _checksum(content)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_text(self._path, json.dumps(content, indent=1) + "\n")


def read_choices(path: Path) -> dict[str, OpenLoop]:
    """Return the choices in a file, by target.

    Raises
    ------
    ValueError
        If the file is not a file of choices, or is damaged.
    """
    return {target: OpenLoop(*each[:2]) for target, each in _read(path)[1].items()}


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Chosen]]:
    """Return the key of the choices in a file, and the choices by target."""
    with reading_json(path, "a file of choices of agents.baselines, or is damaged", FORMAT) as data:
        if data.pop("checksum") != _checksum(data):
            raise ValueError("checksum: does not match the choices")
        key, given = dict(data["key"]), data["choices"]
    try:
        return key, TypeAdapter(dict[str, Chosen]).validate_python(given)
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
        place = errors.dotted(("choices", *wrong["loc"]))
        raise ValueError(f"{path}: {Problem(place, wrong['input'], wrong['msg'])}") from None


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
