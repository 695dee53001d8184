"""The main kernels cost no more than they did; `kernel_costs` says how that is measured."""

import pytest

from magfold_env.benchmarks.runs import KINDS
from magfold_env.engine.compile.jit import numba_config
from tests.benchmarks import kernel_costs
from tests.benchmarks.kernel_costs import (
    beyond,
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


@compiled
def test_kernels_take_no_longer() -> None:
    ratios = stored()["ratios"]
    if processor() not in ratios:
        pytest.skip(f"no costs are stored for {processor()}; to add them: {RENEW}")
    found = slower(ratios[processor()])
    assert not found, f"times as long as stored: {found}; if that is wanted: {RENEW}"


@compiled
def test_more_work_is_told_from_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(kernel_costs.KERNELS, "longer", lambda: chain(2250))
    ratios = typical(["chain", "longer"], kernel_costs.PASSES)
    assert ratios["longer"] / ratios["chain"] > 1.2


def test_a_kernel_that_takes_a_fifth_longer_is_found() -> None:
    known = {"chain": 1.1, "lanes": 2.0}
    assert beyond({"chain": 1.32, "lanes": 2.1}, known) == {"chain": pytest.approx(1.2)}
