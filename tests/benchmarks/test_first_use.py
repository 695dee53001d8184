"""What a first use of the engine costs, in processes of their own."""

import pytest

from magfold_env.benchmarks.dynamics import first_use


@pytest.mark.slow
def test_later_uses_load_what_the_first_compiles() -> None:
    part = first_use.run(True, lambda share, what: None)
    first, later = (float(row["processor time [s]"]) for row in part.rows)
    assert [row["process"] for row in part.rows] == ["first use", "later use"]
    assert later < first / 3
