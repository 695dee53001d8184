"""What the main kernels cost, in units that hardly depend on what else the machine does.

Virtual machines seldom let instructions be counted, and seconds depend on the other work there. So
the time of a kernel is divided by that of a reference compiled in the same process, which does what
kernels do: look-ups that wait for numbers, polynomials, divisions and square roots. The reference
runs right before and after each sample of a kernel, all of a fraction of a millisecond; the shorter
of the two is what counts, and of a pass's ratios the least: other work can only make a sample
longer, and what slows the processor slows both. Every pass uses new arrays, for it matters where
they lie. More passes are made while a kernel seems too slow, with pauses in which other work may
end: noise costs time and no failure. What is stored is typical of a pass.

Ratios depend on what the compiler makes for a processor, so they are stored for each processor and
version of Numba. Elsewhere the largest stored one counts, with more room: the reference stays as it
is, so that its time is measured anew on every machine. How often whole folds evaluate their
accelerations is the same everywhere.

``python -m tests.benchmarks.kernel_costs`` measures this machine and stores it in `STORED`; what
another machine measured stays.
"""

import json
import math
import time
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium
import llvmlite.binding
import numba
import numpy as np

from magfold_bench.folds import scene_of
from magfold_bench.ground_states import random_scene as random_poles
from magfold_bench.laws.integrators import double_euler
from magfold_bench.magnets.samples import FOLDED, pose_of, random_scene, shapes
from magfold_bench.runs import KINDS, ended, run_task
from magfold_bench.scaling import BASE, random_problem, repeat_lanes, repeat_scalar
from magfold_env.engine.chain import recursion
from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.magnets.chain import add_chain_forces
from magfold_env.engine.state import Array, Loads, Model, Nodes, Pose, Rigid
from magfold_env.engine.workspace import new_nodes, new_rigid, new_work
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.files import write_text
from magfold_env.minimiser import Landscape
from magfold_env.scene import load_scene
from magfold_env.shapes import centres, headings
from magfold_env.simulation.pack import pack

STORED = Path(__file__).with_suffix(".json")
COMPONENTS = 6
SEEDS = range(4)  # of the folds of each kind whose evaluations are counted
SAMPLES = 12  # in a pass
PASSES = 40  # at most
PAUSE = 0.3  # [s] between passes
LIMIT = 1.15  # times what is stored: noise must not hide a fifth
ELSEWHERE = 1.6  # on a processor of which nothing is stored
CHAINS = 16  # of the vector environment

Work = Callable[[], object]


@numba.njit(error_model="numpy")
def reference(times, table):
    """Do a mixture of what kernels do, each number waiting for the one before."""
    x = total = 0.3
    for _ in range(times):
        place = x * (table.shape[0] - 1)
        row = table[int(place)]
        u = place - int(place)
        p = ((row[3] * u + row[2]) * u + row[1]) * u + row[0]
        d = 1.0 / (1.0 + p * p)
        total += d * math.sqrt(1.0 + u)
        x = 0.5 * d + 0.25 * u + 0.2 * x
    return total


def reference_work() -> Work:
    table = np.random.default_rng(0).random((256, 4))
    return lambda: reference(8000, table)


def chain(times: int = 1500) -> Work:
    """Accelerations of one pinned chain."""
    problem = random_problem(COMPONENTS)
    scratch, out = np.zeros((recursion.ROWS, COMPONENTS)), np.zeros(COMPONENTS)
    given = (problem.angles, problem.rates, problem.forces, scratch, out)
    return lambda: repeat_scalar(times, problem.bodies, BASE, *given)


def lanes() -> Work:
    """The same for many chains side by side."""
    problem = random_problem(COMPONENTS)
    block = recursion.new_lanes(recursion.LANES, COMPONENTS)[0]
    block[:COMPONENTS, recursion.HEADING] = problem.angles[:, None]
    block[:COMPONENTS, recursion.RATE] = problem.rates[:, None]
    return lambda: repeat_lanes(400, problem.bodies, BASE, block)


@allocating_kernel
def chain_forces(
    times: int, model: Model, q: Array, pose: Pose, nodes: Nodes, rigid: Rigid, out: Loads
) -> None:
    """Do what the dynamics do, look-ups and all, at one state again and again."""
    for _ in range(times):
        for i in range(out.fx.size):
            out.fx[i] = 0.0
            out.fy[i] = 0.0
            out.torque[i] = 0.0
        add_chain_forces(0, 0, model, q, pose, nodes, rigid, out)


def magnets() -> Work:
    """All magnet forces of a folded chain whose joints are a little off their stops."""
    scene = random_scene(np.random.default_rng(3), COMPONENTS)
    model, turned = pack(scene), shapes(COMPONENTS)[FOLDED]
    pose = pose_of(centres(turned, scene.casing.side), turned)
    q = np.append(turned, [0.0, 0.0])
    space = new_nodes(model.magnets, scene.n), new_rigid(model.magnets, scene.n)
    out = Loads(*(np.zeros(scene.n) for _ in range(3)))
    return lambda: chain_forces(25, model, q, pose, *space, out)


def accelerations() -> Work:
    """Accelerations under magnets and sliding friction, as integrators ask for them."""
    scene = load_scene("paper/sequence-3").draw(np.random.default_rng(0))
    model = pack(scene.replace(mount="pinned"))
    work, y = new_work(model), np.zeros(2 * (scene.n + 2))
    y[: scene.n] = headings(np.array(scene.start_angles))
    return lambda: double_euler(model, work, y, 0.0, 80)


def energies() -> Work:
    """Exact energies of all words for some sequences."""
    rng = np.random.default_rng(3)
    landscape = Landscape(random_poles(rng, COMPONENTS))
    signs = rng.choice([-1.0, 1.0], (100, COMPONENTS, 4))
    return lambda: landscape.energies(signs)


def fold(kind: str) -> Callable[[], Work]:
    """Return the preparation of one whole fold, from release to rest."""
    return run_task(scene_of(kind, 0))


@cache
def vector() -> ChainVectorEnv[Any]:
    """Return an environment of many chains, which one thread steps."""
    made = gymnasium.make_vec("MagFold/TubeFeed-v0", CHAINS, threads=1, baseline=None)
    assert isinstance(made.unwrapped, ChainVectorEnv)
    return made.unwrapped


def vector_step() -> Work:
    """Prepare the second step of many chains: their first components are out by then."""
    env = vector()
    env.reset(seed=0)
    env.action_space.seed(0)
    env.step(env.action_space.sample())
    actions = env.action_space.sample()
    return lambda: env.step(actions)


PREPARED = {f"fold: {kind}": fold(kind) for kind in KINDS} | {"vector step": vector_step}
"""Work that is prepared anew for every sample."""
KERNELS = {
    "chain": chain,
    "lanes": lanes,
    "magnets": magnets,
    "accelerations": accelerations,
    "energies": energies,
}


class Clock:
    """The least ratios to the reference seen so far, by kernel."""

    def __init__(self) -> None:
        self.ratios: dict[str, float] = {}

    def watch(self, names: Iterable[str]) -> None:
        """Make one more pass over some kernels."""
        standard = reference_work()
        works = {name: KERNELS[name]() for name in names if name in KERNELS}
        prepared = [name for name in names if name in PREPARED]
        for work in works.values():
            work()
        for k in range(SAMPLES):
            for name, work in works.items():
                work()  # other programs may have emptied the caches
                self.sample(name, work, standard)
            for name in prepared if k % 3 == 0 else ():
                self.sample(name, PREPARED[name](), standard)

    def sample(self, name: str, work: Work, standard: Work) -> None:
        """Time a kernel once."""
        before, spent, after = seconds(standard), seconds(work), seconds(standard)
        ratio = spent / min(before, after)
        self.ratios[name] = min(ratio, self.ratios.get(name, math.inf))


def bounds(ratios: dict[str, dict[str, float]], here: str) -> dict[str, float]:
    """Return how much kernels may cost on a processor, from what is stored of all."""
    own = ratios.get(here, {})
    names = [*KERNELS, *PREPARED]
    return {
        name: LIMIT * own[name]
        if name in own
        else ELSEWHERE * max(each[name] for each in ratios.values() if name in each)
        for name in names
    }


def slower(most: dict[str, float]) -> dict[str, float]:
    """Return how many times as much as they may kernels cost, of those that cost too much."""
    clock, found = Clock(), most
    for again in range(PASSES):
        if again > 0:
            time.sleep(PAUSE)
        clock.watch(found)
        found = beyond(clock.ratios, most)
        if not found:
            break
    return found


def beyond(ratios: dict[str, float], most: dict[str, float]) -> dict[str, float]:
    """Return how many times as much as they may kernels cost, where that is more than once."""
    times = {name: ratio / most[name] for name, ratio in ratios.items()}
    return {name: more for name, more in times.items() if more > 1.0}


def seconds(work: Work) -> float:
    """Processor time of one call [s]."""
    begun = time.thread_time()
    work()
    return time.thread_time() - begun


def evaluations(kind: str) -> int:
    """Return how often folds of a kind evaluate the accelerations, at the default tolerance."""
    return sum(ended(scene_of(kind, seed)).evaluations for seed in SEEDS)


def processor() -> str:
    """Return for what, and with what, kernels are compiled here."""
    return f"{llvmlite.binding.get_host_cpu_name()}, numba {numba.__version__}"


def stored() -> dict[str, dict[str, Any]]:
    return json.loads(STORED.read_text(encoding="utf-8"))


def typical(names: Iterable[str], passes: int) -> dict[str, float]:
    """Return the medians of some passes."""
    clocks = [Clock() for _ in range(passes)]
    for clock in clocks:
        clock.watch(names)
    return {name: median(clock.ratios[name] for clock in clocks) for name in names}


def renew() -> None:
    """Measure this machine and store it beside the others."""
    ratios = typical([*KERNELS, *PREPARED], PASSES)
    record = stored()
    record["evaluations"] = {kind: evaluations(kind) for kind in KINDS}
    record["ratios"][processor()] = {name: round(r, 3) for name, r in ratios.items()}
    write_text(STORED, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    renew()
