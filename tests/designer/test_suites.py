"""Tests of target suites: properties of the shipped ones, and checks of others."""

from pathlib import Path
from typing import Any, get_args

import pytest

import magfold_env as mf
from magfold_bench.lists.suites import WORDS, save_suite, suite_words
from magfold_env.designer.suites import Kind, Suite, Witness, load_suite, suite_names
from magfold_env.designer.task import Choice
from magfold_env.ensembles.releases import release
from magfold_env.minimiser import Mode
from magfold_env.shapes import folded_words

NAMES = suite_names()


@pytest.mark.medium
@pytest.mark.parametrize("name", NAMES)
def test_every_target_has_all_witnesses(name: str) -> None:
    suite = load_suite(name)
    assert name == f"n{suite.n}"
    assert list(suite.targets) == suite_words(suite.n)
    assert len(suite.targets) == (26 if suite.n == 6 else WORDS)
    assert set(suite.targets) <= set(folded_words(suite.n))
    for witnesses in suite.words.values():
        assert set(witnesses) == set(get_args(Kind))
        for kind, witness in witnesses.items():
            assert witness.sequence or witness.certificate
            assert (witness.probability is not None) == (kind in ("forward", "backward", "free"))


@pytest.mark.medium
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("every", [10, pytest.param(1, marks=pytest.mark.slow)])
def test_witnesses_by_energy_hold(every: int, name: str) -> None:
    suite = load_suite(name)
    for word in suite.targets[:: 1 if suite.n == 6 else every]:
        witnesses = suite.words[word]
        if (ground := witnesses["ground"]).sequence:
            scene = suite.scene().replace(sequence=ground.sequence)
            lowest, second = mf.ground_state(scene, top=2).states
            assert lowest.word == word
            assert ground.gap == pytest.approx(second.energy - lowest.energy, rel=1e-9)
        if (unique := witnesses["unique"]).sequence:
            scene = suite.scene().replace(sequence=unique.sequence)
            stable = mf.ground_state(scene, top=2, among="stable").states
            assert [state.word for state in stable] == [word]


@pytest.mark.parametrize("name", ["n6", "n8"])
@pytest.mark.parametrize("mode", ["forward", "backward", "free"])
def test_witnesses_of_release_fold(name: str, mode: Mode) -> None:
    suite = load_suite(name)
    word = suite.targets[7]
    witness: Any = suite.words[word][mode]
    scene = Choice(witness.sequence, witness.speed).applied(release(suite.scene(), mode))
    made = mf.ensemble(scene, 12, seed=99)
    shown: Any = witness.probability
    assert made.probability(word, "folded").high >= shown.low


def test_a_suite_is_written_and_read(tmp_path: Path) -> None:
    witness: Any = Witness(sequence=("NSSN", "NNSS"), speed=0.2, successes=9, releases=10)
    suite = Suite(
        scene_name="design",
        words={"L": {"forward": witness}, "R": {"unique": Witness(certificate="none")}},
    )
    path = tmp_path / "suite.yaml"
    save_suite(suite, path, "Two lines\nof comment")
    assert path.read_text().startswith("# Two lines\n# of comment\n")
    assert load_suite(path) == suite
    assert suite.n == 2
    assert suite.scene().n == 2
    assert witness.probability.rate == 0.9


@pytest.mark.parametrize(("text", "message"), [
    ("scene_name: design\nwords: {L: {}, LR: {}}", "words: .* words of equal length"),
    ("scene_name: design\nwords: {}", "words of equal length"),
    ("scene_name: design\nwords: {LLLL: {}}", "words.LLLL: 'LLLL' is not allowed"),
    ("scene_name: design\nwords: {LX: {}}", "'LX' is not allowed; must consist of"),
    ("scene_name: design\nwords: {L: {forward: {sequence: NSNS}}}", "must have 2 components"),
    ("scene_name: design\nwords: {L: {sideways: {}}}", "sideways"),
    ("words: {L: {}}", "scene_name: None is not allowed; must be given"),
    ("[]", "is not a suite"),
    ("a: b: c", "line 1, column 5"),
])  # fmt: skip
def test_a_wrong_suite_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "suite.yaml"
    path.write_text(text)
    with pytest.raises(mf.SceneError, match=message) as error:
        load_suite(path)
    assert str(path) in str(error.value)
