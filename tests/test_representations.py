"""What results say of themselves in a line."""

import pytest

import magfold_env as mf

SCENE = mf.load_scene("paper/sequence-3")


def test_a_state_says_what_keeps_it_from_being_stable() -> None:
    best, second = mf.minimise(SCENE, top=2).states
    assert repr(best) == f"<State LRLLL: {1e3 * best.energy:.4g} mJ, stable>"
    assert repr(second).endswith(", not folded>")
    (alike,) = mf.minimise(mf.Scene(sequence=("NNNN", "NNNN")), top=1, among="folded").states
    assert repr(alike).endswith("equal poles of 1 and 2 touch, tied with 1>")


@pytest.mark.parametrize(
    ("result", "begin"),
    [
        (mf.minimise(SCENE), "<Minimum: LRLLL -11.39 mJ, SRLLL"),
        (mf.ground_state(SCENE), "<GroundStates: LRLLL -11.39 mJ>"),
        (mf.ensemble(SCENE, 3), "<Ensemble, runs=3: LRLLL folded 100 % (44–100)>"),
        (
            mf.sweep(SCENE, {"friction": [0.1, 0.2]}, runs=1),
            "<Sweep over friction (2 values), runs=1>",
        ),
        (mf.design("L", budget=10, runs=2), "<Design of L, forward: "),
    ],
    ids=lambda value: type(value).__name__,
)
def test_results_fit_into_a_line(result: object, begin: str) -> None:
    assert repr(result).startswith(begin)
    assert len(repr(result)) < 200
