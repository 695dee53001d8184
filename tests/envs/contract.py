"""Rules for every environment, single or in a vector; a violation is an AssertionError."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_match import check_environments_match
from gymnasium.vector import AutoresetMode

from tests.envs.vectors import alike, same
from tests.envs.vectors import play as play_many

Rule = Callable[[str, dict[str, Any]], None]


def play(env: Any, seed: int | None, options: Any = None) -> list[Any]:
    """Play an episode of random actions and return all results."""
    if seed is not None:
        env.action_space.seed(seed)
    said: list[Any] = [env.reset(seed=seed, options=options)]
    ended = False
    while not ended:
        said.append(env.step(env.action_space.sample()))
        ended = said[-1][2] or said[-1][3]
    return said


def group(env: Any, observation: Any, name: str) -> Any:
    """Return a group of entries of an observation."""
    return observation[env.layout.slices[name]]


def made(env_id: str, options: dict[str, Any]) -> Any:
    """Return an environment without wrappers."""
    return gymnasium.make(env_id, **options).unwrapped


def both_checkers_pass(env_id: str, options: dict[str, Any]) -> None:
    """The checkers of Gymnasium and Stable-Baselines3 report no error."""
    env = made(env_id, options)
    check_env(env, skip_render_check=True)
    # The core is also tested where Stable-Baselines3 is missing.
    pytest.importorskip("stable_baselines3.common.env_checker").check_env(env)


def equal_seeds_give_equal_episodes(env_id: str, options: dict[str, Any]) -> None:
    """Equal seeds give equal episodes."""
    first, second = (gymnasium.make(env_id, **options) for _ in range(2))
    check_environments_match(first, second, num_steps=15, seed=3)


def steps_leave_later_episodes_alone(env_id: str, options: dict[str, Any]) -> None:
    """The next episode does not depend on the number of steps in this one."""
    env, other = (made(env_id, options) for _ in range(2))
    env.reset(seed=3)
    play(other, 3)
    assert same(env.reset(), other.reset())


def pickles_and_deep_copies_go_on_alike(env_id: str, options: dict[str, Any]) -> None:
    """Copies in the middle of an episode give the same results as the environment."""
    env = made(env_id, options)
    env.reset(seed=5)
    env.action_space.seed(5)
    action = env.action_space.sample()
    if env.step(action)[2]:  # an episode may be one step
        env.reset(seed=5)
    twins = [pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
    expected = [env.step(action), *play(env, 6)]
    for twin in twins:
        assert same([twin.step(action), *play(twin, 6)], expected)


def states_can_be_returned_to(env_id: str, options: dict[str, Any]) -> None:
    """From any stored state, an environment or another one continues identically."""
    env, other = made(env_id, options), made(env_id, options)
    said: list[Any] = [env.reset(seed=7)]
    env.action_space.seed(7)
    states, actions = [env.get_state()], []
    while not (len(said) > 1 and (said[-1][2] or said[-1][3])):
        actions.append(env.action_space.sample())
        said.append(env.step(actions[-1]))
        states.append(env.get_state())
    after = env.reset()
    for start in sorted({len(states) - 1, len(states) // 2, 1, 0}, reverse=True):
        for one in (env, other):
            observation, info = one.set_state(states[start])
            assert same(observation, said[start][0])
            assert same(info, said[start][-1])
            for k in range(start, len(actions)):
                assert same(one.step(actions[k]), said[k + 1])
            # Random numbers are part of the state.
            assert same(one.reset(), after)


def observations_share_no_memory(env_id: str, options: dict[str, Any]) -> None:
    """Returned observations do not change afterwards."""
    said = play(made(env_id, options), 0)
    kept = copy.deepcopy([each[0] for each in said])
    play(made(env_id, options), 1)
    assert same([each[0] for each in said], kept)


def pictures_show_the_chain(env_id: str, options: dict[str, Any]) -> None:
    """A picture changes only with the chain; the checker passes with pictures too."""
    env = made(env_id, options | {"render_mode": "rgb_array"})
    assert env.metadata["render_modes"] == ["human", "rgb_array", "rgb_array_list", "ansi"]
    assert env.metadata["render_fps"] > 0
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) first"):
        env.render()
    check_env(env)
    env.reset(seed=0)
    before, again = env.render(), env.render()
    assert (before.shape, before.dtype) == ((600, 800, 3), np.uint8)
    np.testing.assert_array_equal(before, again)
    play(env, 0)
    # Of the part that shows the chain, left of the panel.
    assert (before[:, :540] != env.render()[:, :540]).any()
    env.close()
    env.close()


def text_names_the_target_and_every_component(env_id: str, options: dict[str, Any]) -> None:
    """The text names the target and every component at every step."""
    env = made(env_id, options | {"render_mode": "ansi"})
    env.action_space.seed(0)
    env.reset(seed=0)
    over = False
    while not over:
        over = env.step(env.action_space.sample())[2]
        lines = env.render().splitlines()
        assert lines[0].startswith(f"target {env.snapshot().target}, ")
        assert sum(" out" in line or " in the tube" in line for line in lines) >= env.scene.n


def many_states_can_be_returned_to(env_id: str, options: dict[str, Any]) -> None:
    """From any stored state, a vector environment or another one continues identically."""
    mode = AutoresetMode.SAME_STEP
    both: list[Any] = [
        gymnasium.make_vec(env_id, num_envs=5, autoreset_mode=mode, **options).unwrapped
        for _ in range(2)
    ]
    env, other = both
    play_many(env, 2, seed=3)
    # Episodes of different ages: one is begun anew in the middle of the others'.
    env.reset(options={"reset_mask": np.array([True, False, False, True, False])})
    env.step(env.action_space.sample())
    state = env.get_state()
    actions = [env.action_space.sample() for _ in range(9)]

    def said(env: Any) -> str:
        with np.printoptions(threshold=10**6, floatmode="unique"):
            return repr([env.step(action)[:4] for action in actions])

    seen, before = repr(env.episodes.observe()), said(env)
    assert repr(env.set_state(state)) == seen
    assert said(env) == before
    assert repr(other.set_state(pickle.loads(pickle.dumps(state)))) == seen
    assert said(other) == before
    for each in both:
        each.close()


def shapes_by_the_first_potential_alone(env_id: str, shaping: str, options: dict[str, Any]) -> bool:
    """Shaping changes a discounted return only by the potential at the start."""
    gamma, returns = 0.9, []
    shaped = made(env_id, {"shaping": shaping, "gamma": gamma, **options})
    for env in (shaped, made(env_id, options)):
        rewards = [each[1] for each in play(env, 4)[1:]]
        returns.append(sum(gamma**k * reward for k, reward in enumerate(rewards)))
    shaped.reset(seed=4)
    (first,) = shaped.episodes.potential(np.array([0]))
    return returns[0] - returns[1] == pytest.approx(-first)


SINGLE: tuple[Rule, ...] = (
    both_checkers_pass, equal_seeds_give_equal_episodes, steps_leave_later_episodes_alone,
    pickles_and_deep_copies_go_on_alike,
    states_can_be_returned_to, observations_share_no_memory, pictures_show_the_chain,
    text_names_the_target_and_every_component, many_states_can_be_returned_to,
)  # fmt: skip


def many_are_as_single_ones(env_id: str, options: dict[str, Any], mode: AutoresetMode) -> None:
    """A vector environment and as many single ones give identical results."""
    assert alike(env_id, 3, mode, 9, **options)


def name_of(rule: Rule) -> str:
    """Return the name of a rule in a test's name."""
    return rule.__name__
