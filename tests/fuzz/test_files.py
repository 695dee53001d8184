"""Files that are next to right are read, or refused in words that name them: nothing else."""

from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz.mutations import mutated
from tests.fuzz.readers import READERS, outcome

patient = settings(suppress_health_check=[HealthCheck.too_slow])


@cache
def whole(name: str) -> list[bytes]:
    return READERS[name].whole()


@pytest.mark.parametrize("name", READERS)
def test_whole_files_are_read(name):
    for content in whole(name):
        assert outcome(READERS[name], content) == ""


@pytest.mark.parametrize("name", READERS)
@patient
@given(data=st.data())
def test_what_is_next_to_right_is_read_or_refused_clearly(name, data):
    reader = READERS[name]
    content = data.draw(mutated(whole(name), reader.suffix))
    outcome(reader, reader.signed(content))
