"""The main kernels cost no more than they did; `kernel_costs` says how that is measured.

What compares times needs an idle machine, so it runs with the slow tests only.
"""

import pytest

from magfold_bench.runs import KINDS
from magfold_env.engine.compile.jit import numba_config
from tests.benchmarks import kernel_costs
from tests.benchmarks.kernel_costs import (
    KERNELS,
    PREPARED,
    beyond,
    bounds,
    chain,
    evaluations,
    processor,
    slower,
    stored,
    typical,
)

RENEW = "python -m tests.benchmarks.kernel_costs"
compiled = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")


@pytest.mark.parametrize("kind", KINDS)
def test_folds_need_no_more_evaluations(kind: str) -> None:
    known = stored()["evaluations"][kind]
    assert evaluations(kind) < 1.2 * known, f"more than {known}; if that is wanted: {RENEW}"


@pytest.mark.slow
@compiled
def test_kernels_take_no_longer() -> None:
    found = slower(bounds(stored()["ratios"], processor()))
    assert not found, f"times as long as allowed: {found}; if that is wanted: {RENEW}"


@pytest.mark.slow
@compiled
def test_more_work_is_told_from_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(kernel_costs.KERNELS, "longer", lambda: chain(2250))
    ratios = typical(["chain", "longer"], kernel_costs.PASSES)
    assert ratios["longer"] / ratios["chain"] > 1.2


def test_a_kernel_that_takes_a_fifth_longer_is_found() -> None:
    ratios = dict.fromkeys([*KERNELS, *PREPARED], 1.0)
    most = bounds({"here": ratios, "there": ratios | {"lanes": 2.0}}, "here")
    assert beyond({"chain": 1.2, "lanes": 1.1}, most) == {"chain": pytest.approx(1.2 / 1.15)}


def test_on_unknown_processors_twice_as_long_as_anywhere_is_found() -> None:
    ratios = stored()["ratios"]
    most = bounds(ratios, "unknown")
    assert most.keys() == {*KERNELS, *PREPARED}
    slowest = {name: max(each.get(name, 0.0) for each in ratios.values()) for name in most}
    assert beyond(slowest, most) == {}
    assert (
        beyond({name: 2.0 * ratio for name, ratio in slowest.items()}, most).keys() == most.keys()
    )
