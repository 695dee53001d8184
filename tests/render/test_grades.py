"""Grades of magnets: which is nearest to a remanence."""

import pytest

from magfold_env.render.parts import GRADES, Grade, grade_text, nearest_grade


@pytest.mark.parametrize("grade", GRADES, ids=lambda grade: grade.name)
def test_the_middle_of_a_range_is_that_grade(grade: Grade) -> None:
    assert nearest_grade((grade.low + grade.high) / 2) is grade


def test_between_sintered_and_bonded_there_is_none() -> None:
    for remanence, nearest in ((0.9, "N30"), (0.8, "BN10"), (0.1, "BN2"), (1.6, "N52")):
        text = grade_text(remanence)
        assert text.startswith("no common grade; nearest ")
        assert nearest in text
    assert grade_text(1.3) == "NdFeB N42, 1.28–1.32 T"
