"""The energy benchmark: proofs of ground states keep within their time."""

import pytest

from magfold_bench import ground_states


def silent(_share: float, _what: str) -> None:
    pass


@pytest.mark.bench
def test_proofs_keep_within_their_time() -> None:
    findings = ground_states.run(False, silent).findings
    assert findings
    assert not [finding for finding in findings if "NOT within" in finding]
