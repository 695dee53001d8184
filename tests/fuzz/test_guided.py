"""What the guided fuzzers follow exists."""

import importlib

import pytest

from tests.fuzz import guided


@pytest.mark.parametrize("name", guided.READING)
def test_modules_that_are_followed_define_functions(name: str) -> None:
    assert list(guided.functions_of(importlib.import_module(name)))


def test_none_is_followed_twice() -> None:
    assert len({*guided.READING}) == len(guided.READING)
