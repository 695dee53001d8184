"""Policies that can be compared: random, trained ones, and choices made beforehand.

A choice is the magnets of every component and its speed; files hold those of searches.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
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
from magfold_env.scoring.policy_file import Shown

FORMAT = "magfold_env choices 1"
NO_MOTION, BLIND = "no-motion:", "blind:"
"""What the name of a policy begins with that is shown no motion; the second is the older word."""


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

    def action(self, env: FoldEnv[Any], episodes: Any, row: int) -> Any:
        """Return the action with which an episode of an environment goes on as chosen."""
        if env.actions.components > 1:
            return env.actions.encode(self.sequence, self.speeds[0])
        arrays = episodes.arrays
        index = arrays.order(row)[int(arrays.fed[row])]
        return env.actions.encode(self.sequence[index], self.speeds[index])


Act = Callable[[Any, Ints], Sequence[Any]]
"""From episodes and some of their rows to the actions of these, one a row."""

Policy = Callable[[FoldEnv[Any], Sequence[int], Sequence[np.random.Generator]], Act]
"""Begins episodes of an environment, in whose rows it then acts.

It is given the numbers of their targets, and the random numbers of each. It raises a `ValueError`
if it has nothing for a target, or knows other observations or actions."""


def at_random(env: FoldEnv[Any], numbers: object, rngs: Sequence[np.random.Generator]) -> Act:
    """Draw every action evenly."""
    space = env.action_space

    def act(_: object, rows: Ints) -> Sequence[Any]:
        found: list[Any] = []
        for row in rows.tolist():
            space.seed(int(rngs[row].integers(2**31)))
            found.append(space.sample())
        return found

    return act


def designs(env: FoldEnv[Any], numbers: Sequence[int], rngs: object) -> Act:
    """Feed the energy minimiser's design for the target at the speed that suits it best.

    It is the design that the reward is measured against: it does not look at the chain, and its
    speed is the nearest that the actions offer.
    """
    found: dict[str, OpenLoop] = {}
    for target in {env.targets[number] for number in numbers}:
        baseline = env.baseline_of(target)
        if baseline.sequence is None or baseline.speed is None:
            raise ValueError(f"target: {target!r} has no design to follow")
        found[target] = OpenLoop.at_one_speed(baseline.sequence, baseline.speed)
    return chosen(found)(env, numbers, ())


def chosen(choices: Mapping[str, OpenLoop]) -> Policy:
    """Return what plays a choice for each target, whatever the chain does."""

    def begin(env: FoldEnv[Any], numbers: Sequence[int], rngs: object) -> Act:
        targets = [env.targets[number] for number in numbers]
        if missing := [target for target in targets if target not in choices]:
            allowed = f"must be one of {', '.join(choices)}"
            raise ValueError(f"target: {missing[0]!r} has no choice; {allowed}")
        own = [choices[target] for target in targets]
        return lambda episodes, rows: [own[row].action(env, episodes, row) for row in rows.tolist()]

    return begin


def trained(saved: policy_files.SavedPolicy, no_motion: bool = False) -> Policy:
    """Return what plays the most probable actions of a trained policy.

    Of what is observed it is shown what its file says; whatever that is, `no_motion` takes motion
    out of it, see `magfold_env.scoring.shown.blind`.
    """
    shown = saved.shown
    if no_motion:
        shown = Shown(frames=shown.frames, blind=True)

    def begin(env: FoldEnv[Any], numbers: Sequence[int], rngs: object) -> Act:
        player = Player(saved.policy, shown, env, len(numbers))
        return lambda episodes, rows: player.act(episodes.observe())[rows]

    return begin


def at_speed(policy: Policy, speed: float | None) -> Policy:
    """Return what plays the magnets of a policy at one speed [m/s], at random ones for None."""

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

    Parameters
    ----------
    name : str
        ``random``; ``minimiser``, the design that rewards are measured against; the path of
        choices that `agents.baselines` wrote (``.json``), or of a policy (``.safetensors``);
        ``no-motion:`` and one of these, which is then shown no motion.

    Raises
    ------
    ValueError
        If it is none of these, or the file is damaged or not one that is understood.
    """
    no_motion = name.startswith((NO_MOTION, BLIND))
    path = name.partition(":")[2] if no_motion else name
    if path == "random":
        return at_random
    if path == "minimiser":
        return designs
    if not Path(path).is_file():
        raise ValueError(none_called(path, ("random", "minimiser")))
    if Path(path).suffix == ".json":
        return chosen(read_choices(Path(path)))
    torch.set_num_threads(1)
    return trained(policy_files.load(path), no_motion)


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
    with reading_json(path, "a file of choices of agents.baselines, or is damaged", FORMAT) as data:
        if data.pop("checksum") != _checksum(data):
            raise ValueError("checksum: they are not what was saved")
        key, given = dict(data["key"]), data["choices"]
    try:
        return key, TypeAdapter(dict[str, Chosen]).validate_python(given)
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
        place = errors.dotted(("choices", *wrong["loc"]))
        raise ValueError(f"{path}: {Problem(place, wrong['input'], wrong['msg'])}") from None


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
