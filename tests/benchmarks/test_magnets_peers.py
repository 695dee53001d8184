"""How the magnets benchmark compares with other libraries."""

import numpy as np

from magfold_bench.magnets import peers


def test_the_fastest_setting_that_is_as_exact_is_compared():
    def contender(setting, error):
        return peers.Contender(peers.ENGINE, setting, error, lambda: None, 1)

    ours = [contender("rough", 1e-1), contender("good", 1e-3), contender("better", 1e-5)]
    times = {
        each.key: peers.timing.Timing(np.array([time]))
        for each, time in zip(ours, (1.0, 3.0, 2.0), strict=True)
    }
    assert peers.fastest(ours, times, 1e-2) == ours[2].key
    assert peers.fastest(ours, times, 1e-1) == ours[0].key
    assert not peers.fastest(ours, times, 1e-9)


def test_an_absent_peer_is_reported(monkeypatch):
    monkeypatch.setattr(peers, "installed", lambda: False)
    part = peers.run(quick=True, progress=lambda share, what: None)
    assert part.rows == []
    assert "magpylib is absent" in part.findings[0]
