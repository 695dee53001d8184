"""The table that is made in a page is the one that is made elsewhere."""

import pytest

from magfold_env.browser import memory, tables
from magfold_env.engine.compile import by_pointer
from magfold_env.simulation.pack import pack

pytestmark = pytest.mark.skipif(
    not by_pointer.POINTERS, reason="needs kernels that take tuples by pointer"
)


def test_the_largest_table_is_made_to_the_last_bit() -> None:
    scene = memory.standard(3)
    shared = memory.shared_of(scene)
    assert not shared.tables.far.energy.any()
    tables.make_far_table(shared.far, shared.tables)
    made, expected = shared.tables, pack(scene).magnets.tables
    assert made.one.tobytes() == expected.one.tobytes()
    assert made.two.tobytes() == expected.two.tobytes()
    assert made.far.energy.tobytes() == expected.far.energy.tobytes()
