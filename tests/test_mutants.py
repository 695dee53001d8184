"""Tests that the table of mutants fits the sources; ``python -m tests.mutants`` plants them."""

from collections import Counter
from pathlib import Path

import pytest

from tests.mutants import ROOT, Mutant, fate, mutants, plant

TOPICS = {"physics", "rewards", "draws", "views", "intervals", "resuming"}


def test_at_least_forty_errors_of_every_kind_are_planted() -> None:
    topics = Counter(each.topic for each in mutants())
    assert topics.keys() == TOPICS
    assert topics.total() >= 40


@pytest.mark.parametrize("mutant", mutants(), ids=lambda each: each.what)
def test_a_mutant_can_be_planted_and_names_tests_that_exist(mutant: Mutant, tmp_path: Path) -> None:
    copy = tmp_path / mutant.file
    copy.parent.mkdir(parents=True)
    copy.write_text((ROOT / mutant.file).read_text(encoding="utf-8"), encoding="utf-8")
    plant(mutant, tmp_path)
    assert mutant.new in copy.read_text(encoding="utf-8")
    for test in mutant.tests:
        path, _, name = test.partition("::")
        assert f"def {name.partition('[')[0]}" in (ROOT / path).read_text(encoding="utf-8")


FATES = {
    "def test():\n    assert one() == 1": "killed",
    "def test():\n    with pytest.raises(ZeroDivisionError):\n        1 / (one() - 1)": "killed",
    "def test():\n    assert one() > 0": "survived",
    "def test():\n    'ab'[one()]": "broken",
    "@pytest.fixture\ndef given():\n    assert one() == 1\ndef test(given):\n    pass": "broken",
    "assert one() == 1\ndef test():\n    pass": "broken",
}
"""Tests, and the fate of a mutant in which `one` returns 2."""


@pytest.mark.medium
@pytest.mark.parametrize(("test", "end"), FATES.items())
def test_only_a_failed_assertion_of_a_test_kills_a_mutant(test, end, tmp_path):
    (tmp_path / "tiny.py").write_text("def one():\n    return 1\n")
    (tmp_path / "test_tiny.py").write_text(f"import pytest\nfrom tiny import one\n{test}\n")
    mutant = Mutant("physics", "", "tiny.py", "return 1", "return 2", ["test_tiny.py"])
    assert fate(mutant, tmp_path)[0] == end


def test_what_a_mutant_replaces_must_be_there_once(tmp_path: Path) -> None:
    (tmp_path / "tiny.py").write_text("return 1")
    mutant = Mutant("physics", "", "tiny.py", "return 3", "return 2", [])
    with pytest.raises(ValueError, match=r"tiny.py: must hold 'return 3' once, not 0 times"):
        plant(mutant, tmp_path)
