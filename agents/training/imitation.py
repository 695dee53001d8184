"""Imitation of a fairly good player, from which reinforcement learning then continues.

Where success is rare, as with two folds in one episode, random exploration never succeeds. Simple
schedules sometimes do (`magfold_env.envs.baselines`), and players that see a failure can repair it
(`agents.training.drawing_back`, `agents.training.mending`). The networks learn to choose the
actions of such a player and to predict its returns. In some actions, a random entry is replaced, so
that the learner also sees states that the player itself would never reach (Laskey et al., *DART:
noise injection for robust imitation learning*, 2017); the intended actions are imitated.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium.utils import seeding
from numpy.typing import NDArray
from sb3_contrib import RecurrentPPO
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from sb3_contrib.common.recurrent.type_aliases import RNNStates
from stable_baselines3 import PPO
from torch.nn import functional
from torch.nn.utils.rnn import pad_sequence

from agents.commands import progress_bar
from agents.open_loops.search import Search
from agents.settings import TrainSettings
from agents.training import drawing_back
from agents.training.envs import make_env
from agents.training.mending import Mending, mended
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.episodes import Episodes
from magfold_env.scoring.observation_view import ObservationView

BLOCK = 128
"""Number of episodes played in parallel."""


class Steps(NamedTuple):
    """Steps of episodes, one entry per step."""

    seen: NDArray[Any]
    """Observations in the form that networks read."""
    actions: NDArray[Any]
    """Intended actions, without replaced entries."""
    returns: Floats
    """Return from each step to the end of its episode."""
    episodes: Ints
    """Number of each step's episode; the steps of an episode are in order of time."""

    def batches(
        self, size: int, rng: np.random.Generator, by_episode: bool
    ) -> Iterator[NDArray[Any]]:
        """Yield the index of every step once, about `size` at a time, in random order.

        The shape of a batch is (size,) or, if `by_episode`, (episodes, longest), with one whole
        episode per row, padded with −1.
        """
        count = len(self.returns)
        if not by_episode:
            order = rng.permutation(count)
            yield from (order[start : start + size] for start in range(0, count, size))
            return
        order = np.argsort(self.episodes, kind="stable")
        ends = np.flatnonzero(np.diff(self.episodes[order])) + 1
        rows = [torch.as_tensor(each) for each in np.split(order, ends)]
        many = max(1, round(size * len(rows) / count))
        shuffled = rng.permutation(len(rows)).tolist()
        for start in range(0, len(rows), many):
            chosen = [rows[each] for each in shuffled[start : start + many]]
            yield pad_sequence(chosen, batch_first=True, padding_value=-1).numpy()


class Demonstrations:
    """The imitated player's episodes of all tasks in turn; for the arguments, see `imitate`."""

    def __init__(self, settings: TrainSettings, folder: Path) -> None:
        assert settings.imitate is not None
        self._given, self._learner = settings.imitate, settings.learner
        env: Any = make_env(settings.env, settings.learner.gamma).unwrapped
        self._env, self._setup = env, env.setup
        self._rng = np.random.default_rng(settings.seed)
        env.action_space.seed(settings.seed)
        effort = Search(self._given.tried, self._given.trials)
        self._plan: Callable[[Sequence[int]], Plan]
        if self._given.plan == "mending":
            ways = mended(settings.env, folder)
            self._plan = lambda numbers: Mending([ways[number] for number in numbers])
        elif self._given.plan == "drawing back":
            found = drawing_back.searched(settings.env, effort, folder)
            self._plan = lambda numbers: drawing_back.playing([found[number] for number in numbers])
        else:
            self._plan = env.plan_of

    def block(self, seeds: Sequence[int], first: int = 0) -> Steps:
        """Return the steps of episodes with the given seeds, numbered from `first`."""
        count = len(seeds)
        episodes: Episodes[Any] = self._env.make_episodes(self._setup, count)
        numbers: list[int] = (np.arange(first, first + count) % len(self._env.tasks)).tolist()
        plan = self._plan(numbers)
        episodes.rngs[:] = [seeding.np_random(seed)[0] for seed in seeds]
        episodes.begin(episodes.rows, numbers)
        env = self._env
        view = ObservationView(self._learner, env.layout, env.scene, env.observation_space, count)
        rows, begun = episodes.rows, np.ones(count, dtype=np.bool_)
        parts: list[tuple[Any, ...]] = []
        while len(rows):
            seen = view.of(episodes.observe(), begun)[rows]
            actions = self._setup.actions.write(plan(episodes, rows))
            done = self._setup.actions.read(self._disturbed(actions), len(rows))
            rewards, _ = episodes.step(rows, done)
            parts.append((rows, seen, actions, rewards))
            rows, begun = episodes.rows[~episodes.terminated], np.zeros_like(begun)
        value, returns = np.zeros(count), []
        for rows, _, _, rewards in reversed(parts):
            value[rows] = rewards + self._learner.gamma * value[rows]
            returns.append(value[rows])
        played, seen, actions, _ = zip(*parts, strict=True)
        numbers_of = [first + rows for rows in played]
        return Steps(*map(np.concatenate, (seen, actions, returns[::-1], numbers_of)))

    def _disturbed(self, actions: NDArray[Any]) -> NDArray[Any]:
        """Return the actions with a random entry replaced in some of them."""
        actions = actions.copy()
        entries = actions.reshape(len(actions), -1)
        for row in np.flatnonzero(self._rng.random(len(actions)) < self._given.random).tolist():
            place = self._rng.integers(entries.shape[1])
            entries[row, place] = np.ravel(self._env.action_space.sample())[place]
        return actions


def imitate(model: PPO | RecurrentPPO, settings: TrainSettings, folder: Path) -> None:
    """Let a new model with these settings imitate a player of its tasks.

    A recurrent model learns from whole episodes. All runs share the searches in `folder`.
    """
    given = settings.imitate
    assert given is not None
    steps, policy = _steps(settings, given.episodes, folder), model.policy
    optimizer = torch.optim.Adam(policy.parameters())
    rng, count = np.random.default_rng(settings.seed), len(steps.returns)
    by_episode = isinstance(model, RecurrentPPO)
    policy.set_training_mode(True)
    with progress_bar() as bar:
        task = bar.add_task("imitation", total=given.epochs * count, note="")
        for epoch in range(given.epochs):
            optimizer.param_groups[0]["lr"] = given.learning_rate * (1.0 - epoch / given.epochs)
            likely, learned = 0.0, 0
            for batch in steps.batches(given.batch_size, rng, by_episode):
                values, log_probability, returns = evaluated(policy, steps, batch)
                wrong = functional.mse_loss(values, returns)
                loss = -log_probability.mean() + model.vf_coef * wrong
                optimizer.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_(policy.parameters(), model.max_grad_norm)
                optimizer.step()
                likely += log_probability.sum().item()
                learned += len(returns)
                note = f"log-likelihood {likely / learned:.2f}"
                bar.update(task, advance=len(returns), note=note)


def evaluated(
    policy: Any, steps: Steps, batch: NDArray[Any]
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return a policy's values, the log-probabilities of the actions, and the returns.

    All three are for the steps in a `batch` from `Steps.batches`, without padding.
    """
    flat = batch.ravel()
    seen, actions, returns = (
        torch.as_tensor(each[flat]) for each in (steps.seen, steps.actions, steps.returns)
    )
    memory: tuple[Any, ...] = ()
    if isinstance(policy, RecurrentActorCriticPolicy):
        lstm = policy.lstm_actor
        nothing = 2 * (torch.zeros(lstm.num_layers, len(batch), lstm.hidden_size),)
        memory = RNNStates(nothing, nothing), torch.zeros(len(flat))
    values, log_probability, _ = policy.evaluate_actions(seen, actions, *memory)
    meant = torch.as_tensor(flat >= 0)
    return values.flatten()[meant], log_probability[meant], returns.float()[meant]


def _steps(settings: TrainSettings, episodes: int, folder: Path) -> Steps:
    """Return the steps of `episodes` episodes."""
    shown = Demonstrations(settings, folder)
    # Training seeds are below 2³².
    numbers = np.random.SeedSequence(settings.seed, spawn_key=(0,)).generate_state(episodes)
    seeds: list[int] = numbers.tolist()
    parts: list[Steps] = []
    with progress_bar() as bar:
        task = bar.add_task("demonstrations", total=episodes, note="")
        for first in range(0, episodes, BLOCK):
            parts.append(shown.block(seeds[first : first + BLOCK], first))
            bar.update(task, completed=min(first + BLOCK, episodes))
    return Steps(*map(np.concatenate, zip(*parts, strict=True)))
