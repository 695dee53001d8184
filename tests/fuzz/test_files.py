"""Files that are next to right are read, or refused in words that name them: nothing else."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz.mutations import mutated
from tests.fuzz.readers import READERS, outcome

quick = settings(suppress_health_check=[HealthCheck.too_slow])


@pytest.mark.parametrize("name", READERS)
def test_whole_files_are_read(name):
    reader = READERS[name]
    for content in reader.whole():
        told = outcome(reader, content)
        assert told == "" or name in {"policy", "choices", "state"}


@pytest.mark.parametrize("name", READERS)
@quick
@given(data=st.data())
def test_what_is_next_to_right_is_read_or_refused_clearly(name, data):
    reader = READERS[name]
    content = data.draw(mutated(WHOLE[name], reader.suffix))
    outcome(reader, reader.signed(content))


WHOLE = {name: reader.whole() for name, reader in READERS.items()}
