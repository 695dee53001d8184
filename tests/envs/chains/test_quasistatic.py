from itertools import product

import gymnasium
import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.chains.quasistatic import QuasistaticChains, fold
from magfold_env.envs.spaces.actions import PATTERNS, signs_of
from magfold_env.shapes import overlaps, word_to_angles

ROW = np.array([0])
SPEED = np.array([0.1])
TURNS = {"S": 0.0, "L": np.pi / 2, "R": -np.pi / 2}


def random_sequence(rng: np.random.Generator, n: int) -> tuple[str, ...]:
    return tuple(PATTERNS[k] for k in rng.integers(16, size=n))


def built(n: int, direction: str = "forward") -> mf.Scene:
    scene = mf.load_scene("tube-built").replace(sequence=("NSNS",) * n)
    return scene.replace(feed={"direction": direction}, magnets={"accuracy": 1e-6})


@pytest.mark.medium
@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("n", [2, 6, 9])
def test_a_chain_built_beforehand_folds_as_the_minimiser_says(direction: str, n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(20):
        scene = built(n, direction).replace(sequence=random_sequence(rng, n))
        found, said = fold(scene), mf.minimise(scene, mode=direction).states[0]  # pyright: ignore[reportArgumentType]
        assert found.word == said.word
        assert found.energy == pytest.approx(said.energy)


def by_hand(scene: mf.Scene, order: list[int]) -> str:
    """Fold by `mf.energy`, without magnets of components that are in the tube."""
    letters = ["S"] * (scene.n - 1)
    for count in range(2, scene.n + 1):
        out = set(order[:count])
        so_far = scene.replace(
            sequence=tuple(f if k in out else "----" for k, f in enumerate(scene.sequence))
        )
        joint = max(out) - 1 if order[0] == 0 else min(out)
        energies = {}
        for letter in "SLR":
            word = "".join([*letters[:joint], letter, *letters[joint + 1 :]])
            inside = word[: count - 1] if order[0] == 0 else word[joint:]
            if not overlaps(inside):
                headings = np.concatenate([[0.0], np.cumsum(word_to_angles(word))])
                energies[letter] = mf.energy(so_far, headings)
        # Of mirror images, which differ by rounding alone, the first.
        least = min(energies.values()) + 1e-12 * max(map(abs, energies.values()))
        letters[joint] = next(letter for letter, energy in energies.items() if energy <= least)
    return "".join(letters)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_magnets_act_only_once_they_are_out(direction: str) -> None:
    rng = np.random.default_rng(1)
    n = 5
    order = list(range(n)) if direction == "forward" else list(reversed(range(n)))
    for _ in range(8):
        scene = built(n, direction).replace(
            sequence=random_sequence(rng, n), feed={"loading": "at_mouth"}
        )
        assert fold(scene).word == by_hand(scene, order)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_component_by_component_or_at_once_gives_the_same(direction: str) -> None:
    scene = built(7, direction).replace(feed={"loading": "at_mouth"})
    rules = LatticeFeed(scene)
    rng = np.random.default_rng(2)
    for _ in range(20):
        sequence = random_sequence(rng, 7)
        steps, whole = QuasistaticChains(rules, 1), QuasistaticChains(rules, 1)
        patterns = np.array([[PATTERNS.index(faces) for faces in sequence]])
        for chains in (steps, whole):
            chains.begin(ROW)
        while steps.arrays.status[0] == 0:
            index = steps.arrays.order(0)[int(steps.arrays.fed[0])]
            steps.feed(ROW, patterns[:, index : index + 1], SPEED, SPEED)
        whole.feed(ROW, patterns, SPEED, SPEED)
        assert steps.word(0) == whole.word(0)
        assert steps.arrays.status[0] == whole.arrays.status[0]
        np.testing.assert_array_equal(steps.arrays.angles, whole.arrays.angles)
        assert steps.energies(ROW) == whole.energies(ROW)
        assert fold(whole.scene(0)).word == whole.word(0)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_the_chain_lies_where_the_tube_has_it(direction: str) -> None:
    scene = built(6, direction).replace(feed={"loading": "at_mouth"})
    pitch = scene.casing.diagonal
    chains = QuasistaticChains(LatticeFeed(scene), 1)
    chains.begin(ROW)
    rng = np.random.default_rng(3)
    for out in range(7):
        angles, base = chains.arrays.angles[0], chains.arrays.base[0]
        assert chains.arrays.released.sum() == out
        turns = [TURNS[letter] for letter in chains.word(0)]
        np.testing.assert_allclose(np.diff(angles), turns, atol=1e-12)
        hinges = base + np.cumsum(pitch * np.column_stack([np.cos(angles), np.sin(angles)]), axis=0)
        hinges = np.vstack([base, hinges])
        mouth = hinges[out] if direction == "forward" else hinges[6 - out]
        np.testing.assert_allclose(mouth, 0.0, atol=1e-12)
        inside = hinges[out:] if direction == "forward" else hinges[: 7 - out]
        np.testing.assert_allclose(inside[:, 1], 0.0, atol=1e-12)
        assert (inside[:, 0] <= 1e-12).all()
        if out < 6:
            chains.feed(ROW, rng.integers(16, size=(1, 1)), SPEED, SPEED)


def test_energies_of_a_target_are_those_of_its_word() -> None:
    scene = built(6).replace(feed={"loading": "at_mouth"})
    rules = LatticeFeed(scene)
    sequence = random_sequence(np.random.default_rng(4), 6)
    signs = np.array([signs_of(faces) for faces in sequence])
    headings = np.concatenate([[0.0], np.cumsum(word_to_angles("LRRLR"))])
    expected = mf.energy(scene.replace(sequence=sequence), headings)
    assert rules.energy_as("LRRLR", signs, 6) == pytest.approx(expected, rel=1e-6)
    first = mf.energy(scene.replace(sequence=sequence[:3]), headings[:3])
    assert rules.energy_as("LRRLR", signs, 3) == pytest.approx(first, rel=1e-6)


@pytest.mark.medium
def test_a_chain_that_grows_into_a_corner_has_misfolded() -> None:
    env = gymnasium.make("MagFold/TubeFeed-v0", fidelity="quasistatic", components=16).unwrapped
    rng = np.random.default_rng(0)
    stuck = False
    for _ in range(3000):
        env.reset()
        ended, info = False, {}
        while not ended:
            observation, reward, ended, _, info = env.step(rng.integers([16, 9]))
            assert observation in env.observation_space
            assert np.isfinite(float(reward))
        if info["step"] < 16:
            stuck = True
            assert info["status"] == "misfolded"
            assert "stuck" in info["message"]
            break
    assert stuck


def test_speeds_and_randomisation_change_nothing() -> None:
    words = set()
    for randomisation, speed in product(("none", "nominal", "strong"), (0, 8)):
        env = gymnasium.make(
            "MagFold/TubeFeed-v0", fidelity="quasistatic", randomisation=randomisation
        ).unwrapped
        env.reset(seed=0)
        info: dict = {}
        for pattern in (1, 2, 3, 4, 5, 6):
            *_, info = env.step(np.array([pattern, speed]))
        words.add((info["word"], info["energy"]))
        assert info["baseline_missing"]
    assert len(words) == 1
