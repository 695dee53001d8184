"""Networks that choose actions, computed without torch, with the layers of Stable-Baselines3."""

from itertools import pairwise
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from magfold_env.scene import Problem, SceneError
from magfold_env.scene.errors import refuse
from magfold_env.scoring import policy_file
from magfold_env.scoring.observation_view import form_space
from magfold_env.scoring.policy_file import PolicyFile, PolicySettings

Singles = NDArray[np.float32]
State = list[tuple[Singles, Singles]]
"""Outputs and cell states of the recurrent layers, each of shape (episodes, width)."""


class Actor:
    """A policy that chooses its most probable actions.

    Files with unsupported networks, or with weights of other shapes, raise a ValueError.
    """

    def __init__(self, file: PolicyFile) -> None:
        settings = file.settings
        _refuse_others(settings)
        self.settings = settings
        self.observation_space = form_space(settings, settings.observations.space())
        self.action_space = settings.actions.space()

        def layer(weight: str, bias: str, before: int, after: int) -> tuple[Singles, Singles]:
            """Return the weights and biases of a layer with these names and widths."""
            found = file.weights({weight: (after, before), bias: (after,)})
            return found[weight].T, found[bias]

        width, memory = settings.frames * settings.observations.size, settings.lstm
        self._memory: list[list[tuple[Singles, Singles]]] = []
        if memory is not None:
            for k in range(memory.layers):
                weight, bias = (f"lstm_actor.{each}_{{}}_l{k}" for each in ("weight", "bias"))
                gates = [
                    layer(weight.format(name), bias.format(name), before, 4 * memory.hidden)
                    for name, before in (("ih", width), ("hh", memory.hidden))
                ]
                self._memory.append(gates)
                width = memory.hidden
        sizes = (width, *settings.actor, settings.actions.size)
        self._layers = [
            layer(f"{name}.weight", f"{name}.bias", *widths)
            for name, widths in zip(_layers(settings), pairwise(sizes), strict=True)
        ]

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a policy from a file."""
        file = policy_file.read(path)
        try:
            return cls(file)
        except SceneError as error:
            raise SceneError(error.problems, str(path)) from None
        except ValueError as error:
            raise ValueError(f"{path}: weights: {error}") from None

    def predict(
        self,
        observation: NDArray[Any],
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], State | None]:
        """Return actions for a batch of observations, and the recurrent states of the episodes."""
        entries: Singles = observation.reshape(len(observation), -1).astype(np.float32)
        *hidden, (weight, bias) = self._layers
        with np.errstate(over="ignore", invalid="ignore"):
            if self._memory:
                begun = np.zeros(len(entries), np.bool_) if episode_start is None else episode_start
                entries, state = self._remembered(entries, state, begun)
            for each in hidden:
                entries = entries @ each[0] + each[1]
                tanh = self.settings.activation == "tanh"
                entries = np.tanh(entries) if tanh else np.maximum(entries, 0.0)
            entries = entries @ weight + bias
        if not np.isfinite(entries).all():
            raise ValueError("weights: are too large; the outputs of the network are not finite")
        return self._chosen(entries), state

    def _remembered(
        self, entries: Singles, state: State | None, begun: NDArray[np.bool_]
    ) -> tuple[Singles, State]:
        """Return the outputs and the new state of the LSTM layers."""
        nothing = np.zeros(1, np.float32)
        before = state or [(nothing, nothing)] * len(self._memory)
        goes_on = (~begun)[:, None].astype(np.float32)
        after: State = []
        for (shown, kept), (output, cell) in zip(self._memory, before, strict=True):
            gates = entries @ shown[0] + shown[1] + kept[1]
            if state is not None:
                gates = gates + (goes_on * output) @ kept[0]
            taken, held, new, told = np.split(gates, 4, axis=1)
            inside = _share(held) * goes_on * cell + _share(taken) * np.tanh(new)
            entries = _share(told) * np.tanh(inside)
            after.append((entries, inside))
        return entries, after

    def _chosen(self, entries: Singles) -> NDArray[Any]:
        """Return the actions that the outputs of the last layer represent."""
        actions = self.settings.actions
        if isinstance(actions, policy_file.Discrete):
            return entries.argmax(axis=1)
        if isinstance(actions, policy_file.MultiDiscrete):
            parts = np.split(entries, np.cumsum(actions.nvec)[:-1], axis=1)
            return np.stack([each.argmax(axis=1) for each in parts], axis=1)
        low, high = (np.array(each, np.float32) for each in (actions.low, actions.high))
        if self.settings.algorithm not in ("sac", "tqc"):
            return np.clip(entries, low, high)
        return low + np.float32(0.5) * (np.tanh(entries) + np.float32(1.0)) * (high - low)


def _share(entries: Singles) -> Singles:
    """Return the logistic function of each entry."""
    return np.float32(0.5) * (np.float32(1.0) + np.tanh(np.float32(0.5) * entries))


def _refuse_others(settings: PolicySettings) -> None:
    """Raise a `SceneError` for unsupported features and for observations of several boxes."""
    problems: list[Problem] = []
    if settings.features != "chain":
        problems.append(Problem("features", settings.features, "must be 'chain'"))
    if isinstance(settings.observations, policy_file.Boxes):
        names = list(settings.observations.boxes)
        problems.append(Problem("observations.boxes", names, "must be a box (low, high)"))
    refuse(problems)


def _layers(settings: PolicySettings) -> list[str]:
    """Return the names of the actor's layers in a file, from the first to the last."""
    shared = settings.algorithm not in ("sac", "tqc")
    hidden = "mlp_extractor.policy_net" if shared else "actor.latent_pi"
    last = "action_net" if shared else "actor.mu"
    return [*(f"{hidden}.{2 * k}" for k in range(len(settings.actor))), last]
