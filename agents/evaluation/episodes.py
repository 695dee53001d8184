"""The players of a comparison, and the episodes that they play.

An ablation removes part of a player; see "Ablations" in ``docs/evaluation.md``. A policy
whose speeds are replaced still observes the chain and the actual speeds.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast
from zlib import crc32

import joblib
import numpy as np
from rich.progress import Progress

import magfold_env as mf
from agents.evaluation import policies
from agents.evaluation.shipped import shipped_files
from agents.settings import EnvSettings
from agents.training.envs import make_env as make_gym_env
from agents.training.folder import file_digest
from magfold_env.checkpoint import Checkpoint
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.tasks.goals import judged
from magfold_env.parallel import without_warning
from magfold_env.scoring import player as scoring

Result = TypeVar("Result")

NO_MOTION, FROZEN, RANDOM_SPEEDS = "no motion", "frozen", "random speeds"

Change = str | float | None
"""The removed part: one of these names, or a speed [m/s] that replaces all speeds, or None."""


@dataclass(frozen=True)
class Outcome:
    """The result of an episode."""

    target: str
    """The target word."""
    word: str
    """The resulting word."""
    status: str
    """Status of the fold."""
    seed: int
    """Seed of the episode's draws."""
    success: bool
    """Whether the fold is the target."""
    score: float
    """Score of the fold at the end."""
    reward: float
    """Return, which is the sum of the rewards."""
    joints: tuple[float, ...] = ()
    """Joint angles at the end [rad]."""
    choice: policies.OpenLoop | None = None
    """The requested components and speeds; None if the simulation failed before all were
    requested."""
    scene: mf.Scene | None = None
    """The scene that replays the episode; None if `choice` is None."""
    built: bool | None = None
    """Whether the same choice under the same draws folds into the target if the chain is built
    beforehand, so that its magnets also act inside the tube; None if this was not tried."""
    built_score: float | None = None
    """Score of the chain built beforehand."""

    @property
    def record(self) -> dict[str, Any]:
        """The values of the episode that are stored, as JSON values."""
        aside = ("joints", "choice", "scene")
        return {key: value for key, value in vars(self).items() if key not in aside}


@dataclass(frozen=True)
class Method:
    """The policies compared under one name."""

    name: str
    """Name in tables."""
    policies: tuple[str, ...]
    """Arguments of `agents.evaluation.policies.make_policy`, one per seed."""
    change: Change = None
    """The part removed from the policies."""
    built: bool = False
    """Whether every chosen chain is also built beforehand and then folded."""

    @classmethod
    def parse(cls, text: str) -> "Method":
        """Return the method described by ``NAME=PATH,PATH,...`` or by a single policy.

        A single policy is named after its file, without suffix. If the file is a training run's
        ``policy.safetensors``, it is named after the file's folder. The name of a set of shipped
        policies stands for the paths of all its seeds.

        Raises
        ------
        ValueError
            If a name or a policy is empty, or a policy is given twice.
        """
        name, separator, listed = text.rpartition("=")
        shipped = policies.shipped_names()
        files = tuple(
            path
            for each in listed.split(",")
            for path in (map(str, shipped_files(each)) if each in shipped else (each,))
        )
        if not all(files) or (separator and not name) or len(set(files)) < len(files):
            raise ValueError(
                f"{text!r} is not allowed; must be random, minimiser, a path, or NAME=PATH,PATH,… "
                "with a path for each seed"
            )
        path = Path(listed)
        short = path.parent.name if path.stem == "policy" and path.parent.name else path.stem
        return cls(name or (listed if listed in shipped else short), files)


def parse_methods(texts: Sequence[str]) -> list[Method]:
    """Return the methods described by `texts`.

    Raises
    ------
    ValueError
        If a text is not allowed, or two methods have the same name.
    """
    methods = [Method.parse(text) for text in texts]
    names = [method.name for method in methods]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"{twice[0]}: two methods have this name; give others, NAME=PATH")
    return methods


def make_env(settings: EnvSettings) -> FoldEnv[Any]:
    """Return the environment for evaluation.

    Shaping is removed, because it does not change a fold and its rewards are not compared.
    """
    return cast("FoldEnv[Any]", make_gym_env(settings.unshaped()).unwrapped)


@cache
def own_env(settings: EnvSettings) -> FoldEnv[Any]:
    """Return an environment for evaluation that the current process creates once and reuses."""
    return make_env(settings)


own_policy = cache(policies.make_policy)
"""Returns the policy with a name; the current process loads it once and reuses it."""


def changed(name: str, change: Change, settings: EnvSettings) -> policies.Policy:
    """Return the policy called `name`, unchanged or with a part removed."""
    if change == NO_MOTION:
        return own_policy(policies.NO_MOTION + name)
    policy = own_policy(name)
    if change is None:
        return policy
    if change != FROZEN:
        return policies.at_speed(policy, None if isinstance(change, str) else change)

    def frozen(env: FoldEnv[Any], numbers: Sequence[int], rngs: Any) -> policies.Act:
        targets = {env.targets[number] for number in numbers}
        found = {each: _rehearsed(name, settings, each) for each in targets}
        return policies.chosen(found)(env, numbers, rngs)

    return frozen


@cache
def _rehearsed(name: str, settings: EnvSettings, target: str) -> policies.OpenLoop:
    """Return what a policy chooses in an episode without randomisation."""
    env = own_env(settings.model_copy(update={"randomisation": "none"}))
    choice = play(own_policy(name), env, target, seed=0).choice
    if choice is None:
        raise ValueError(f"{name}: without randomisation the simulation of {target} broke down")
    return choice


def warm_up(settings: EnvSettings) -> None:
    """Play an episode with random actions, to compile the engine before anything else begins.

    Compiling takes up to a minute after an installation. It must not count as training time or
    happen in every process.
    """
    env = make_env(settings)
    env.reset(seed=0)
    env.action_space.seed(0)
    ended = False
    while not ended:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = terminated or truncated


def check(policy: str, settings: EnvSettings) -> None:
    """Let a policy choose its first action for each target, to find errors before episodes begin.

    Raises
    ------
    ValueError
        If there is no such policy, or if it lacks a target or has other observations or actions.
    """
    env, player = own_env(settings), own_policy(policy)
    for number, target in enumerate(env.targets):
        env.reset(seed=0, options={"target": target})
        try:
            player(env, [number], [np.random.default_rng(0)])(env.episodes, np.array([0]))
        except ValueError as error:
            path = Path(policy)
            trained = path.suffix == ".safetensors"
            remedy = "; magfold score plays the policies of tracks" if trained else ""
            # Messages call a shipped policy by its name.
            given = path.stem if path.parent == policies.policies_dir() else policy
            raise ValueError(f"{given}: {error}{remedy}") from None


def play(
    policy: policies.Policy,
    env: FoldEnv[Any],
    target: str,
    seed: int,
    built: bool = False,
) -> Outcome:
    """Play an episode and return its outcome.

    `seed` determines the episode's draws and, with `target`, the policy's draws. If `built`, the
    chosen chain is also built beforehand and then folded.
    """
    key = (1, crc32(target.encode()))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    number, actions = env.setup.number_of(target), list[Any]()

    def plan_of(_: slice) -> Plan:
        act = policy(env, [number], [rng])

        def plan(episodes: Any, rows: Ints) -> Any:
            (action,) = act(episodes, rows)
            actions.append(action)
            return env.actions.read_one(action)

        return plan

    (ends,) = scoring.play(env.episodes, [number], [seed], plan_of)
    end = {name: column.tolist()[0] for name, column in ends.items()}
    reward = env.setup.rule.end(ends["score"], ends["is_success"], ends["baseline"])
    episodes, row = env.episodes, np.array([0])
    scene = env.to_scene() if episodes.arrays.fed[0] == env.scene.n else None
    built_success, built_score = built_beforehand(env, scene, target) if built else (None, None)
    in_order = actions if env.scene.feed.direction == "forward" else actions[::-1]
    return Outcome(
        target=target,
        word=str(episodes.words(row)[0]),
        status=end["status"],
        seed=seed,
        success=end["is_success"],
        score=end["score"],
        reward=float(reward[0]),
        joints=tuple(env.state.joint_angles.tolist()),
        choice=None if scene is None else policies.OpenLoop.of_actions(env, in_order),
        scene=scene,
        built=built_success,
        built_score=built_score,
    )


def built_beforehand(
    env: FoldEnv[Any], scene: mf.Scene | None, target: str
) -> tuple[bool | None, float | None]:
    """Return the success and score of an episode's chain if it is built beforehand.

    Both are None without dynamics. A `scene` that is None means that the simulation failed.
    """
    if env.task.fidelity != "dynamics":
        return None, None
    if scene is None:
        return False, 0.0
    fold = mf.simulate(scene.replace(feed={"loading": "preloaded"}))
    ((_, score, reached),) = judged(target, env.task.match, [fold]).T.tolist()
    return reached == 1.0, score


def spread_over(
    processes: int, function: Callable[..., Result], jobs: Iterable[tuple[Any, ...]]
) -> Iterator[Result]:
    """Yield a function's result for each job, a tuple of arguments, in order.

    Several `processes` share the work and are reused later; 1 means the current process.
    """
    parallel: Any = joblib.Parallel(processes, return_as="generator")
    yield from without_warning(parallel(joblib.delayed(function)(*job) for job in jobs))


@dataclass
class Table:
    """The episodes of players, one row per player; several processes play them."""

    bar: Progress
    """Progress bar of every row."""
    processes: int
    folder: Path | None = None
    """Folder that stores episodes; stored episodes are not played again."""
    key: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Everything on which the episodes depend, as JSON values."""
    wait: bool = False
    """Whether to wait for another run that uses the folder instead of raising an error."""

    def row(
        self,
        name: str,
        count: int,
        job: Callable[[int, int], tuple[Any, ...]],
        played: Callable[..., list[Any]],
        block: int = 1,
        key: Mapping[str, Any] | None = None,
    ) -> list[Any]:
        """Return `count` records of a player; stored records are not played again.

        `name` names the row and its folder, and `key` contains further values on which these
        records depend. They are played in blocks of at most `block`. `job` maps the index of a
        block's first record, and the index after its last, to the arguments of `played`, which
        returns the block, perhaps in another process. Stored records must be JSON values.
        """
        task = self.bar.add_task(name, total=count, note="")
        path = None if self.folder is None else self.folder / name.replace(" ", "-")
        with Checkpoint(path, {**self.key, **(key or {})}, self.wait) as kept:
            records = [] if path is None else kept.load()[:count]
            jobs = [job(at, min(at + block, count)) for at in range(len(records), count, block)]
            for found in spread_over(self.processes, played, jobs):
                for record in found:
                    records.append(record)
                    kept.add(record)
                self.bar.update(task, completed=len(records))
        return records


def play_all(
    table: Table,
    method: Method,
    policy: str,
    settings: EnvSettings,
    episodes: Sequence[tuple[str, int]],
) -> list[Outcome]:
    """Return the outcomes of a policy in `episodes`, pairs of target and seed, in order."""
    stored = table.folder is not None

    def job(start: int, stop: int) -> tuple[Any, ...]:
        return policy, method, settings, episodes[start:stop], stored

    if not stored:
        return table.row(method.name, len(episodes), job, _play)
    digest = file_digest(policy) or policy
    targets, seeds = (list(dict.fromkeys(each)) for each in zip(*episodes, strict=True))
    key = {"player": digest, "change": method.change, "built": method.built}
    key |= {"targets": targets, "seeds": seeds}
    name = f"{method.name} {digest[:16]}"
    records = table.row(name, len(episodes), job, _play, key=key)
    return [Outcome(**record) for record in records]


def _play(
    policy: str,
    method: Method,
    settings: EnvSettings,
    episodes: Sequence[tuple[str, int]],
    stored: bool,
) -> list[Any]:
    """Return the outcomes of episodes played in this process, as records if `stored`."""
    player, env = changed(policy, method.change, settings), own_env(settings)
    found = [play(player, env, target, seed, method.built) for target, seed in episodes]
    return [each.record for each in found] if stored else found
