"""Tests that `magfold warmup` compiles everything that later commands need."""

from pathlib import Path

import pytest

from magfold_env.engine.compile.jit import numba_config
from tests.command_line import python, run

USES = """
import gymnasium

import magfold_env as mf
from magfold_env.envs import ENTRY_POINTS
from magfold_env.scene.io import scene_names

for name in scene_names():
    scene = mf.load_scene(name).replace(duration=0.1)
    mf.simulate(scene, seed=1)
    if scene.mount == "tube":
        schedule = {"time": [(0.05, 0.3), (0.05, -0.3)]}
        mf.simulate(scene.replace(feed={"schedule": schedule}), seed=1)
    if scene.magnets is not None and scene.field is None:
        mf.minimise(scene, mode="free", top=2)
    mf.ensemble(scene, runs=3, seed=0)
longer = mf.Scene(sequence=["NSNS", "NNSS"] * 5, friction=0.2, duration=0.1)
for changes in (
    {"mount": "pinned"},
    {"contact": False},
    {"magnets": {"model": "strips"}},
    {"gravity": {"in_plane": (0.1, 0.0)}},
    {"obstacles": [{"position": (0.05, 0.05), "size": (0.02, 0.02)}]},
):
    mf.simulate(longer.replace(**changes), seed=2)
mf.design("LLR", mode="backward", runs=4, budget=30)
mf.holding(mf.simulate(mf.load_scene("paper/sequence-3").replace(mount="free")))
for env_id in ENTRY_POINTS:
    env = gymnasium.make(env_id)
    env.reset(seed=3)
    env.step(env.action_space.sample())
    envs = gymnasium.make_vec(env_id, num_envs=5)
    envs.reset(seed=3)
    for _ in range(8):
        envs.step(envs.action_space.sample())
"""


def test_everything_that_is_warmed_up_runs() -> None:
    result = run("warmup", code=0)
    assert "kept on the disk" in result.stdout


@pytest.mark.slow
@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")
def test_no_kernel_is_left_to_be_compiled(tmp_path: Path) -> None:
    def kept_after(*arguments: str) -> set[str]:
        python(*arguments, XDG_CACHE_HOME=str(tmp_path))
        return {str(each.relative_to(tmp_path)) for each in tmp_path.rglob("*.nb*")}

    warm = kept_after("-c", "from magfold_env.cli.app import app; app()", "warmup")
    assert len(warm) > 40
    assert kept_after("-c", USES) == warm
