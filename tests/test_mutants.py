"""The table of mutants fits the sources; ``python -m tests.mutants`` plants them."""

from collections import Counter
from pathlib import Path

import pytest

from tests.mutants import ROOT, Mutant, fate, mutants, plant

TOPICS = {"physics", "rewards", "draws", "intervals", "resuming"}


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


@pytest.mark.medium
@pytest.mark.parametrize(
    ("test", "end"),
    [("assert one() == 1", "killed"), ("assert one() > 0", "survived"), ("1 +", "broken")],
)
def test_who_survives_is_told(test: str, end: str, tmp_path: Path) -> None:
    (tmp_path / "tiny.py").write_text("def one():\n    return 1\n")
    (tmp_path / "test_tiny.py").write_text(f"from tiny import one\ndef test():\n    {test}\n")
    mutant = Mutant("physics", "", "tiny.py", "return 1", "return 2", ["test_tiny.py"])
    assert fate(mutant, tmp_path)[0] == end
    with pytest.raises(ValueError, match=r"tiny.py: must hold 'return 3' once, not 0 times"):
        plant(mutant._replace(old="return 3"), tmp_path)
