"""Record episodes as a dataset in Minari's format: ``python -m agents.record ENV``.

The dataset is for learners without an environment. An episode's metadata contain its final info
(target, success and score) and its seed, with which the environment repeats the episode bit for
bit. All draws use training seeds, which no reported result uses.
"""

# pyright: reportMissingImports=false

import re
import warnings
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import typer
from gymnasium import spaces

from agents.commands import EnvChanges, needing, progress_bar, run_command
from agents.evaluation.episodes import check
from agents.evaluation.policies import Policy, make_policy, shipped_names
from agents.evaluation.shipped import shipped_files
from agents.settings import EnvSettings, checked, parse_assignment, put
from agents.training.envs import make_env
from magfold_env.envs.fold_env import FoldEnv

TOLD = ("target", "is_success", "score")
"""Keys of an episode's final info that are stored."""


def record(settings: EnvSettings, policy: str, episodes: int, seed: int, name: str) -> Any:
    """Play a number of episodes and return them as a Minari dataset, which is stored on disk.

    Raises
    ------
    ValueError
        If there is no such policy, or it belongs to other environments; if a dataset of that name
        exists, or the name is not allowed.
    """
    import minari  # noqa: PLC0415 (an extra of its own)

    if not re.fullmatch(r"([\w-]+/)*[\w-]+-v\d+", name):
        allowed = "must look like magfold/TubeFeed/random-v0, with letters, digits, - and _"
        raise ValueError(f"dataset: {name!r} is not allowed; {allowed}")
    if name in minari.list_local_datasets():
        raise ValueError(f"dataset: {name!r} already exists; must be a new name")
    played_by = str(shipped_files(policy)[0]) if policy in shipped_names() else policy
    env, player = make_env(settings), make_policy(played_by)
    if policy != "random" and not isinstance(env.unwrapped, FoldEnv):
        raise ValueError(f"policy: {policy!r} is not allowed in {settings.id}; must be random")
    if policy != "random":
        check(played_by, settings)
    # Training seeds are below 2³².
    seeds: list[int] = np.random.SeedSequence(seed).generate_state(episodes).tolist()
    with progress_bar() as bar:
        task = bar.add_task(settings.id, total=episodes, note="")
        played = [_play(env, player, each) for each in bar.track(seeds, task_id=task)]
    with warnings.catch_warnings():
        # Minari warns that no author and no environment for evaluation are named.
        warnings.filterwarnings("ignore", "`.*` is set to None", UserWarning)
        dataset = minari.create_dataset_from_buffers(
            name,
            [episode for episode, _ in played],
            env=env,
            algorithm_name=policy,
            description=f"{settings.id}, recorded by python -m agents.record",
            data_format="hdf5",
        )
    dataset.storage.update_episode_metadata(
        [{key: end[key] for key in TOLD if key in end} for _, end in played]
    )
    return dataset


def _play(env: Any, policy: Policy, seed: int) -> tuple[Any, dict[str, Any]]:
    """Return an episode as a Minari buffer, and its final info."""
    from minari.data_collector import EpisodeBuffer  # noqa: PLC0415

    inner, row = cast("FoldEnv[Any]", env.unwrapped), np.array([0])
    observation, info = env.reset(seed=seed)
    act = policy(inner, inner.episodes.numbers.tolist(), [np.random.default_rng(seed)])
    seen, actions, steps, over = [observation], list[Any](), list[Any](), False
    while not over:
        actions.append(act(inner.episodes, row)[0])
        observation, reward, terminated, truncated, info = env.step(actions[-1])
        over = terminated or truncated
        seen.append(observation)
        steps.append((float(reward), terminated, truncated))
    names = ("rewards", "terminations", "truncations")
    columns: dict[str, Any] = dict(zip(names, map(list, zip(*steps, strict=True)), strict=True))
    columns["observations"] = _columns(env.observation_space, seen)
    columns["actions"] = _columns(env.action_space, actions)
    return EpisodeBuffer(seed=seed, infos={}, **columns), info


def _columns(space: Any, values: list[Any]) -> Any:
    """Return values of a space in Minari's form, with one array per part."""
    if isinstance(space, spaces.Dict):
        return {key: _columns(part, [v[key] for v in values]) for key, part in space.items()}
    return np.stack([np.asarray(value, dtype=space.dtype) for value in values])


def main(
    env_id: Annotated[str, typer.Argument(metavar="ENV", help="Such as MagFold/TubeFeed-v0.")],
    policy: Annotated[
        str,
        typer.Option(
            help="random, minimiser, a set of shipped policies (the first one plays), "
            "choices (.json) or a policy (.safetensors)."
        ),
    ] = "random",
    env: EnvChanges = None,
    episodes: Annotated[int, typer.Option(min=1, help="Number of episodes.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all draws.")] = 0,
    dataset: Annotated[
        str | None,
        typer.Option(help="Name of the Minari dataset; magfold/ENV/POLICY-v0 by default."),
    ] = None,
) -> None:
    """Record episodes in the folder given by MINARI_DATASETS_PATH, or in ~/.minari/datasets."""
    with needing("agents,minari"):
        content: dict[str, Any] = {"id": env_id}
        for change in env or []:
            put(content, *parse_assignment(change))
        settings = checked(EnvSettings, content, "ENV")
        short = env_id.removeprefix("MagFold/").rpartition("-v")[0]
        name = dataset or f"magfold/{short}/{Path(policy).stem}-v0"
        made = record(settings, policy, episodes, seed, name)
    typer.echo(f"dataset: {name}, {made.total_steps} steps", err=True)


if __name__ == "__main__":
    run_command(main)
