"""The energy benchmark: proofs of ground states keep within their time."""

import pytest

from magfold_bench import ground_states


def silent(_share: float, _what: str) -> None:
    pass


def test_every_length_is_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ground_states, "QUICK_PROVED", {8: 2, 10: 1})
    part = ground_states.run(True, silent)
    assert [(row["components"], row["proved"]) for row in part.rows] == [(8, 2), (10, 1)]


@pytest.mark.bench
def test_proofs_keep_within_their_time() -> None:
    findings = ground_states.run(False, silent).findings
    assert findings
    assert not [finding for finding in findings if "NOT within" in finding]
