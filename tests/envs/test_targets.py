import pytest

from magfold_env.envs.targets import pick_target, resolve_targets
from magfold_env.shapes import folded_words


def test_all_fully_folded_words_by_default() -> None:
    assert resolve_targets(None, 6) == tuple(folded_words(6))
    assert len(resolve_targets(None, 6)) == 26


def test_a_list_is_kept_in_its_order() -> None:
    assert resolve_targets(["RRRLR", "LRLLL"], 6) == ("RRRLR", "LRLLL")


@pytest.mark.parametrize(
    ("targets", "named"),
    [
        (["LRLL"], "'LRLL'"),  # a letter short
        (["LRSLL"], "'LRSLL'"),  # not fully folded
        (["LLLLL"], "'LLLLL'"),  # overlaps
        (["LRLLX"], "'LRLLX'"),
        ("LRLLL", "'LRLLL'"),  # a word, not a list of words
        ([], r"\[\]"),
    ],
)
def test_wrong_targets_are_named(targets: list[str], named: str) -> None:
    with pytest.raises(ValueError, match=rf"targets: {named} is not allowed; must be"):
        resolve_targets(targets, 6)


def test_a_wrong_option_is_named_with_what_is_allowed() -> None:
    with pytest.raises(ValueError, match=r"options\['target'\]: 'LLRRL' .* one of LRLLL, LRLRL"):
        pick_target("LLRRL", ("LRLLL", "LRLRL"))
