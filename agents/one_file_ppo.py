"""PPO in one file, to copy and change: ``python agents/one_file_ppo.py``.

It needs magfold_env and torch, and nothing else from this folder. It trains on tube feed with all
targets of six components: first by energy alone, where steps cost almost nothing, then with
dynamics. At the end, the greedy policy plays draws that training never uses.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import gymnasium
import numpy as np
import torch
import typer
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from rich import progress
from torch import nn
from torch.distributions import Categorical

import magfold_env  # noqa: F401 (registers the environments)
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.envs.wrappers.vector import MouthOrderObservation
from magfold_env.reporting.intervals import Share, share

ENVS = 64
"""Number of parallel environments."""

ROLLOUT = 48
"""Steps per environment between two updates: eight episodes."""

EPOCHS, BATCH = 4, 512
"""Passes over the steps in an update, and steps in a minibatch."""

LEARNING_RATE = 1.5e-3
"""Learning rate of Adam, which falls linearly to zero over each phase."""

LAMBDA = 0.95
"""Trade-off of bias and variance in the advantages; the discount is 1."""

CLIP = 0.2
"""Largest change of an action's probability in an update, as a ratio."""

ENTROPY, VALUE = 0.01, 0.5
"""Weights of the entropy and of the value loss."""

LARGEST_GRADIENT = 0.5
"""Largest norm of the gradient."""

WIDTH = 256
"""Units of the two hidden layers of actor and critic."""


class Agent(nn.Module):
    """Actor and critic."""

    def __init__(self, entries: int, choices: list[int]) -> None:
        super().__init__()
        self.choices = choices
        self.actor, self.critic = network(entries, sum(choices), 0.01), network(entries, 1, 1.0)

    def distributions(self, seen: torch.Tensor) -> list[Categorical]:
        """Return the distributions of the parts of the action: magnets and speed."""
        logits = self.actor(seen).split(self.choices, dim=1)
        return [Categorical(logits=each) for each in logits]

    def value(self, seen: torch.Tensor) -> torch.Tensor:
        """Return the rewards expected until the end of the episode."""
        return self.critic(seen)[:, 0]


def network(entries: int, outputs: int, gain: float) -> nn.Sequential:
    """Return a network whose last layer's weights are scaled by `gain`."""

    def layer(width: int, outputs: int, gain: float) -> nn.Linear:
        made = nn.Linear(width, outputs)
        nn.init.orthogonal_(made.weight, gain)
        nn.init.zeros_(made.bias)
        return made

    hidden = [layer(entries, WIDTH, 2**0.5), nn.Tanh(), layer(WIDTH, WIDTH, 2**0.5), nn.Tanh()]
    return nn.Sequential(*hidden, layer(WIDTH, outputs, gain))


def log_probability(distributions: list[Categorical], actions: torch.Tensor) -> torch.Tensor:
    """Return the logarithm of the probability of whole actions."""
    parts = [each.log_prob(part) for each, part in zip(distributions, actions.T, strict=True)]
    return torch.stack(parts).sum(dim=0)


def make_envs(count: int, **options: Any) -> MouthOrderObservation:
    """Return environments that begin the next episode in the same step that ends one.

    Observations are within ±1. A running normalisation would do harm: by energy alone, many entries
    never vary, and would be far out of scale when dynamics begin.
    """
    envs = gymnasium.make_vec(
        "MagFold/TubeFeed-v0",
        num_envs=count,
        autoreset_mode=AutoresetMode.SAME_STEP,
        reward="score",
        **options,
    )
    return MouthOrderObservation(envs)


class Steps(NamedTuple):
    """Data of an update, (steps, …)."""

    seen: torch.Tensor
    actions: torch.Tensor
    log_probability: torch.Tensor
    advantage: torch.Tensor
    returned: torch.Tensor


def train(
    agent: Agent,
    envs: MouthOrderObservation,
    steps: int,
    seed: int,
    deadline: float,
    report: Callable[[int, float], None],
) -> int:
    """Train for a number of environment steps, or until `deadline`; return the steps made.

    After each update, `report` is called with the steps so far and the share of successful
    episodes.
    """
    optimizer = torch.optim.Adam(agent.parameters(), LEARNING_RATE, eps=1e-5)
    seen = torch.from_numpy(envs.reset(seed=seed)[0])
    done = 0
    while done < steps and time.monotonic() < deadline:
        for group in optimizer.param_groups:
            group["lr"] = LEARNING_RATE * (1.0 - done / steps)
        seen, batch, success = roll_out(agent, envs, seen)
        update(agent, optimizer, batch)
        done += ROLLOUT * ENVS
        report(done, success)
    return done


@torch.no_grad()
def roll_out(
    agent: Agent, envs: MouthOrderObservation, seen: torch.Tensor
) -> tuple[torch.Tensor, Steps, float]:
    """Return the next observations, the data of the steps, and the share of successful episodes."""
    observations: list[torch.Tensor] = []
    chosen: list[torch.Tensor] = []
    probabilities: list[torch.Tensor] = []
    rewards, over = torch.zeros(ROLLOUT, ENVS), torch.zeros(ROLLOUT, ENVS)
    values = torch.zeros(ROLLOUT + 1, ENVS)
    successes: list[bool] = []
    for step in range(ROLLOUT):
        distributions = agent.distributions(seen)
        actions = torch.stack([each.sample() for each in distributions], dim=1)
        observations.append(seen)
        chosen.append(actions)
        probabilities.append(log_probability(distributions, actions))
        values[step] = agent.value(seen)
        observation, reward, terminated, _, infos = envs.step(actions.numpy())
        seen = torch.from_numpy(observation)
        # Every episode terminates; with an external time limit, the value of `final_obs` of
        # truncated episodes would have to be added to their rewards here.
        rewards[step], over[step] = torch.from_numpy(reward), torch.from_numpy(terminated)
        if terminated.any():
            successes += infos["final_info"]["is_success"][terminated].tolist()
    values[ROLLOUT] = agent.value(seen)
    advantages, following = torch.zeros(ROLLOUT, ENVS), torch.zeros(ENVS)
    for step in reversed(range(ROLLOUT)):
        going_on = 1.0 - over[step]
        error = rewards[step] + going_on * values[step + 1] - values[step]
        following = error + LAMBDA * going_on * following
        advantages[step] = following
    parts = (torch.stack(observations), torch.stack(chosen), torch.stack(probabilities))
    batch = Steps(*(each.flatten(0, 1) for each in (*parts, advantages, advantages + values[:-1])))
    return seen, batch, float(np.mean(successes))


def update(agent: Agent, optimizer: torch.optim.Optimizer, steps: Steps) -> None:
    """Increase the probability of actions that did better than expected."""
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(steps.seen)).split(BATCH):
            batch = Steps(*(each[rows] for each in steps))
            distributions = agent.distributions(batch.seen)
            ratio = (log_probability(distributions, batch.actions) - batch.log_probability).exp()
            spread = batch.advantage.std() + 1e-8
            advantage = (batch.advantage - batch.advantage.mean()) / spread
            clipped = ratio.clamp(1.0 - CLIP, 1.0 + CLIP)
            gain = torch.min(ratio * advantage, clipped * advantage).mean()
            entropy = torch.stack([each.entropy() for each in distributions]).sum(dim=0).mean()
            error = (agent.value(batch.seen) - batch.returned).square().mean()
            optimizer.zero_grad()
            (VALUE * error - gain - ENTROPY * entropy).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), LARGEST_GRADIENT)
            optimizer.step()


@torch.no_grad()
def evaluate(agent: Agent, draws: int) -> Share:
    """Return the success of the greedy policy: all targets, the same held-out draws for each."""
    targets: tuple[str, ...] = gymnasium.make("MagFold/TubeFeed-v0").get_wrapper_attr("targets")
    envs = make_envs(len(targets) * draws)
    words = [word for word in targets for _ in range(draws)]
    seeds = evaluation_seeds(draws) * len(targets)
    observation, _ = envs.reset(seed=seeds, options={"target": words})
    # An episode may end early; the one that follows it does not count.
    success: NDArray[np.bool_] = np.zeros(len(words), dtype=np.bool_)
    playing = ~success
    while playing.any():
        distributions = agent.distributions(torch.from_numpy(observation))
        actions = torch.stack([each.probs.argmax(dim=1) for each in distributions], dim=1)
        observation, _, terminated, _, infos = envs.step(actions.numpy())
        ended = terminated & playing
        if ended.any():
            success[ended] = infos["final_info"]["is_success"][ended]
        playing &= ~terminated
    envs.close()
    return share(int(success.sum()), len(words))


def main(
    seed: Annotated[int, typer.Option(min=0, help="Seed of networks, actions and draws.")] = 0,
    energy_steps: Annotated[int, typer.Option(min=0, help="Steps by energy alone.")] = 100_000,
    steps: Annotated[int, typer.Option(min=0, help="Steps with dynamics.")] = 100_000,
    minutes: Annotated[float, typer.Option(help="Longest training time.")] = 9.0,
    draws: Annotated[int, typer.Option(min=1, help="Evaluation episodes per target.")] = 20,
    output: Annotated[Path | None, typer.Option(help="File for the weights.")] = None,
) -> None:
    """Train a policy for tube feed and print its rate of success."""
    # Two threads on such small networks are no faster, and far slower on a busy machine.
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    began = time.monotonic()
    deadline = began + 60.0 * minutes
    phases = {
        "by energy alone": (make_envs(ENVS, fidelity="quasistatic"), energy_steps),
        "with dynamics": (make_envs(ENVS), steps),
    }
    envs: Any = phases["with dynamics"][0]
    agent = Agent(envs.single_observation_space.shape[0], envs.single_action_space.nvec.tolist())
    made: dict[str, int] = {}
    columns = ("{task.description}", progress.BarColumn(), "{task.completed:.0f}/{task.total:.0f}")
    with progress.Progress(*columns, "{task.fields[note]}", progress.TimeElapsedColumn()) as bar:
        for number, (name, (envs, count)) in enumerate(phases.items()):
            task = bar.add_task(name, total=count, note="")

            def report(done: int, success: float, task: progress.TaskID = task) -> None:
                bar.update(task, completed=done, note=f"success {100 * success:.0f} %")

            # Each phase has its own draws.
            made[name] = train(agent, envs, count, 2 * seed + number, deadline, report)
            envs.close()
    spent = time.monotonic() - began
    steps_made = ", ".join(f"{count} steps {name}" for name, count in made.items())
    typer.echo(f"trained in {spent:.0f} s: {steps_made}")
    if output is not None:
        torch.save(agent.state_dict(), output)
    typer.echo(f"greedy, held-out draws: {evaluate(agent, draws)}")


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command()(main)
    app()
