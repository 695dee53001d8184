"""``python -m magfold_bench``: measure this machine and this version."""

from magfold_bench.commands import bench

bench(prog_name="python -m magfold_bench")
