"""What holds of the paper's sequences in its own model and with the device's magnets alike."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.minimiser import Landscape, State, minimise
from magfold_env.shapes import centres, headings, outline, word_to_angles

both_models = pytest.mark.parametrize("suffix", ["", "-literal"])


def folded(k: int, suffix: str) -> dict[str, State]:
    found = minimise(mf.load_scene(f"paper/sequence-{k}{suffix}"), top=26, among="folded")
    return {state.word: state for state in found.states}


def stable(states: dict[str, State]) -> list[str]:
    return [word for word, state in states.items() if state.stable]


def turned(word: str, other: str) -> list[int]:
    """Joints, 1-based, whose angles differ."""
    return [k + 1 for k, (a, b) in enumerate(zip(word, other, strict=True)) if a != b]


@both_models
def test_the_ground_states_are_s1a_s2a_and_s3a(suffix: str) -> None:
    for k in (1, 2, 3):
        best = minimise(mf.load_scene(f"paper/sequence-{k}{suffix}")).best
        assert best.word == "LRLLL"
        assert best.stable


@both_models
def test_what_lies_below_s1c(suffix: str) -> None:
    states = folded(1, suffix)
    below = {w: s for w, s in states.items() if s.energy < states["LRLLR"].energy}
    assert states["LRLLR"].stable
    assert stable(below) == ["LRLLL", "RRLLL"]
    assert below["LRRRL"].conflicts == ((4, 5),)
    assert outline("LRLLR") != outline("LRLLL")


@both_models
def test_how_the_states_of_sequence_2_differ(suffix: str) -> None:
    s2a, s2b, s2c = "LRLLL", "LRLRL", "LRRLL"
    states = folded(2, suffix)
    assert stable(states) == [s2a, s2b, s2c]
    assert turned(s2a, s2b) == [4]  # between components 4 and 5
    assert len(turned(s2c, s2b)) == 2
    assert len(states[s2a].contacts) == 1 + max(len(states[w].contacts) for w in (s2b, s2c))
    assert (3, 6) in states[s2a].contacts


@both_models
def test_sequence_3_has_one_stable_state_with_the_outline_of_s1a(suffix: str) -> None:
    states = folded(3, suffix)
    assert stable(states) == ["LRLLL"]
    assert {(4, 5), (3, 6)} <= set(states["LRLLL"].contacts)


@both_models
def test_the_magnets_press_every_joint_of_the_stable_states_against_its_stop(suffix: str) -> None:
    for k in (1, 2, 3):
        landscape = Landscape(mf.load_scene(f"paper/sequence-{k}{suffix}"), "folded")
        held = dict(zip(landscape.words, landscape.mechanically_stable(), strict=True))
        states = folded(k, suffix)
        assert all(held[word] for word in stable(states))
        # Of those with a conflict only one is held against its repulsion.
        assert [w for w in held if held[w] and not states[w].stable] == ["LRRRL"] * (k == 1)


def test_where_the_reconstruction_misses_the_papers_energies() -> None:
    one = {word: state.coulomb_score for word, state in folded(1, "-literal").items()}
    two = {word: state.coulomb_score for word, state in folded(2, "-literal").items()}
    assert one["LRLLL"] * 1e3 == pytest.approx(-25.8098 * 1.034, rel=1e-3)
    assert one["RRLLL"] / one["LRLLL"] == pytest.approx(0.99564, abs=1e-5)  # the paper: 0.993913
    assert 1 - two["LRLLL"] / two["LRLRL"] == pytest.approx(0.530, abs=1e-3)  # 55.89 %
    assert two["LRRLL"] / two["LRLRL"] - 1 == pytest.approx(0.065, abs=1e-3)  # 8.75 %


def test_the_least_lateral_movement_of_sequence_1_is_not_s1c() -> None:
    def lateral(word: str) -> float:
        return float(np.abs(centres(headings(word_to_angles(word)))[:, 1]).mean())

    movement = {word: lateral(word) for word in stable(folded(1, "-literal"))}
    assert movement["LRRLL"] == pytest.approx(min(movement.values()))
    assert movement["LRLLR"] > 2 * movement["LRRLL"]
