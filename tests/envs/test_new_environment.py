"""Tests that a new environment needs about a hundred lines to satisfy the common contract.

**Span**: choose the feed speed of each component of a chain with random magnets, so that the ends
of the chain lie close to each other. CONTRIBUTING.md explains this example.
"""

from collections.abc import Iterator
from typing import Any, TypedDict, Unpack

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.arrays import FAILED, Floats, Ints
from magfold_env.envs.episodes import Columns, Episodes
from magfold_env.envs.spaces.actions import PATTERNS, SLOWEST_LEVEL, SpeedTable, scaled_speeds
from magfold_env.envs.spaces.observation import chain_layout, fill
from magfold_env.envs.tasks.checks import refuse_unknown
from magfold_env.envs.tasks.draws import Randomisation
from magfold_env.envs.tasks.reward import Shaping
from magfold_env.envs.tasks.setup import Setup
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import load_scene
from tests.envs import contract

SPAN = "MagFold/Span-v0"
NEAR = 0.3
"""Largest distance of a chain's ends in a success, relative to its length."""


class SpanOptions(TypedDict, total=False):
    """Options of the environment."""

    randomisation: Randomisation
    shaping: bool | Shaping
    gamma: float


class SpanSetup(Setup):
    """The data that all episodes share."""

    def __init__(self, **options: Unpack[SpanOptions]) -> None:
        refuse_unknown(options, SpanOptions)
        scene = load_scene("tube-feed")
        super().__init__(scene, options)
        self.words = ("LRLLL", "LLRLL")
        self.actions = SpeedTable(5)
        self.layout = chain_layout(scene.n, scene.casing.side)


class SpanEpisodes(Episodes[NDArray[np.float32]]):
    """Episodes in which chains with random magnets are fed, one component per step."""

    setup: SpanSetup
    kept = (*Episodes.kept, "drawn")

    def allocate(self) -> None:
        """Make the arrays that episodes store."""
        super().allocate()
        self.drawn: Ints = np.zeros((self.count, self.n), dtype=np.int64)
        """Patterns of the components, in the order of feed, (m, n)."""

    def reset_rows(self, rows: Ints) -> None:
        """Draw the chains of some episodes, and their magnets."""
        super().reset_rows(rows)
        for row in rows.tolist():
            self.drawn[row] = self.rngs[row].integers(len(PATTERNS), size=self.n)

    def act(self, rows: Ints, choice: tuple[Floats]) -> None:
        """Feed the next component of each chain; the direction of the speed is ignored."""
        speeds = np.maximum(np.abs(choice[0]), SLOWEST_LEVEL)
        patterns = self.drawn[rows, self.arrays.fed[rows]][:, None]
        self.chains.feed(rows, patterns, speeds, scaled_speeds(speeds))

    def observe(self) -> NDArray[np.float32]:
        """Return new observations, (m, size)."""
        layout = self.setup.layout
        out = np.empty((self.count, layout.size), dtype=np.float32)
        fill(layout.side, self.chains.seen, self.goals.one_hot, out)
        return out

    def final_infos(self, rows: Ints) -> Columns:
        """Return the infos that only terminated episodes have."""
        angles = self.arrays.angles[rows]
        ends = np.hypot(np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)) / self.n
        failed = self.arrays.status[rows] == FAILED
        score, near = np.where(failed, 0.0, 1.0 - ends), ~failed & (ends < NEAR)
        return super().final_infos(rows) | {"score": score, "is_success": near}


class SpanEnv(ChainEnv[NDArray[np.float32]]):
    """An environment with one chain."""

    make_episodes = SpanEpisodes

    def __init__(self, *, render_mode: str | None = None, **options: Unpack[SpanOptions]) -> None:
        super().__init__(SpanSetup(**options), render_mode)


SpanVectorEnv = ChainVectorEnv[Any].of(SpanEnv)


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    gymnasium.register(SPAN, SpanEnv, vector_entry_point=SpanVectorEnv)
    yield
    del gymnasium.registry[SPAN]


@pytest.mark.parametrize("hold", contract.SINGLE, ids=contract.name_of)
def test_it_keeps_the_contract(hold: contract.Rule) -> None:
    hold(SPAN, {})


@pytest.mark.parametrize("mode", AutoresetMode)
def test_its_vector_form_says_what_single_ones_do(mode: AutoresetMode) -> None:
    contract.many_are_as_single_ones(SPAN, {}, mode)


def test_it_can_be_shaped() -> None:
    assert contract.shapes_by_the_first_potential_alone(SPAN, "similarity", {})


def test_wrong_options_are_named() -> None:
    with pytest.raises(ValueError, match="argument 'speed'; must be one of scene, random"):
        gymnasium.make(SPAN, speed=3)
