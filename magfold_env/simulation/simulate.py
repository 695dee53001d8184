"""Simulate one fold, or many on all cores, and compute magnet forces."""

import threading
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.engine.chain import articulated, recursion
from magfold_env.engine.magnets.chain import magnet_energy, magnet_loads
from magfold_env.engine.magnets.outer_field import add_magnet_forces
from magfold_env.engine.workspace import new_work
from magfold_env.fold import Fold
from magfold_env.parallel import threads_of
from magfold_env.scene import Problem, Scene, SceneError, errors, unless_a_scene
from magfold_env.shapes import centres
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Progress, Session

Floats = npt.NDArray[np.float64]

LARGEST = 1e14
"""Largest angles [rad] and rates [rad/s] with accurate sines and squares; floats of this size are
0.02 apart."""


def simulate(
    scene: Scene,
    seed: int | np.random.Generator = 0,
    *,
    frame_rate: float | None = None,
    progress: Progress | None = None,
) -> Fold:
    """Simulate one fold.

    Parameters
    ----------
    scene
        The scene to simulate.
    seed
        Seed of the random values of the scene: its start angles and its spreads. A seed always
        gives the same fold, bit for bit.
    frame_rate
        Frames recorded per simulated second [1/s], up to a million, and one more at the end; None
        records no trajectory. Recording does not change the fold.
    progress
        Called at least about twenty times per second of computation with the simulated time [s] and
        the number of components out of the tube. An exception that it raises stops the run.

    Returns
    -------
    Fold
        The result; ``fold.scene`` is the drawn scene, which gives the same fold again.

    Raises
    ------
    SceneError
        If an argument has a value that is not allowed.
    """
    errors.refuse([*unless_a_scene(scene), *errors.unless_function("progress", progress)])
    session = Session(scene.draw(_generator(seed)), frame_rate)
    if progress is not None:
        session.progress = progress
    session.settle()
    return session.fold()


def simulate_batch(
    scenes: Scene | Sequence[Scene],
    seeds: Iterable[int | np.random.Generator],
    *,
    threads: int | None = None,
    frame_rate: float | None = None,
) -> list[Fold]:
    """Simulate many folds on several threads; the kernels release the interpreter's lock.

    Every fold equals the result of `simulate` for its scene and seed, bit for bit, for any number
    of threads.

    Parameters
    ----------
    scenes
        The scenes to simulate: one for all seeds, or one for each seed.
    seeds
        One seed per fold; see `simulate`.
    threads
        Number of parallel folds; None uses all cores.
    frame_rate
        Frames recorded per simulated second [1/s], as for `simulate`; None records no trajectories.

    Returns
    -------
    list of Fold
        The folds in the order of the seeds.

    Raises
    ------
    SceneError
        If an argument has a value that is not allowed, or the numbers of scenes and seeds differ.
    """
    given: Any = seeds
    ordered = isinstance(given, Iterable) and not isinstance(given, str | bytes | set | Mapping)
    if not ordered or getattr(seeds, "ndim", 1) != 1:
        raise SceneError([Problem("seeds", given, "must be seeds in order, one a fold")])
    if not isinstance(scenes, Scene):
        errors.refuse(errors.unless_a("scenes", scenes, Sequence, "a Scene, or one for each seed"))
    draws = list(seeds)
    chosen = [scenes] * len(draws) if isinstance(scenes, Scene) else list(scenes)
    if len(chosen) != len(draws):
        allowed = f"must be one, or as many as the {len(draws)} seeds"
        raise SceneError([Problem("scenes", len(chosen), allowed)])
    workers = threads_of(threads)

    stopped = threading.Event()

    def check(_time: float, _released: int) -> None:
        if stopped.is_set():
            raise CancelledError

    def run(scene: Scene, seed: int | np.random.Generator) -> Fold:
        return simulate(scene, seed, frame_rate=frame_rate, progress=check)

    if workers == 1 or len(draws) < 2:
        return [run(scene, seed) for scene, seed in zip(chosen, draws, strict=True)]
    with ThreadPoolExecutor(workers, thread_name_prefix="fold") as pool:
        try:
            return list(pool.map(run, chosen, draws))
        finally:
            stopped.set()


def accelerations(scene: Scene, angles: npt.ArrayLike, rates: npt.ArrayLike) -> Floats:
    """Return the angular accelerations (..., n) [rad/s²] of the pinned chain under smooth forces.

    Magnets, in-plane gravity and inertia act; contact, stops and friction do not. The equations are
    the paper's eq. 39, solved in O(n) time. Many states may be stacked; a state gives the same bits
    alone and in a stack.

    Parameters
    ----------
    scene
        The chain; its mount is ignored.
    angles, rates
        Headings [rad] and their rates [rad/s], both of the same shape (..., n), component 1 first.

    Raises
    ------
    SceneError
        If ``scene`` is not a scene, a shape is not (..., n), the shapes differ, or a number exceeds
        `LARGEST`.
    """
    headings = checked("angles", angles, scene, stacked=True)
    speeds = checked("rates", rates, scene, stacked=True)
    if headings.shape != speeds.shape:
        raise SceneError([Problem("rates", speeds.shape, f"must have shape {headings.shape}")])
    model = pack(scene.alone())._replace(contact=False, frictional=False)
    flat = np.ascontiguousarray(headings.reshape(-1, scene.n))
    loads: Floats | None = None
    if model.magnetic:
        loads = np.empty_like(flat)
        magnet_loads(model, flat, new_work(model), loads)
    # A hinge that accelerates upward is equivalent to one at rest in a field that pulls downward.
    base = (-model.gravity_x, -model.gravity_y)
    out = recursion.accelerate_many(model.bodies, base, flat, speeds.reshape(flat.shape), loads)
    return out.reshape(headings.shape)


def forces(
    scene: Scene, angles: npt.ArrayLike, *, about: npt.ArrayLike | None = None
) -> tuple[Floats, Floats]:
    """Return the magnet forces (n, 2) [N] and torques (n,) [N·m] on the components.

    Parameters
    ----------
    scene
        The chain; its mount is ignored.
    angles
        Headings [rad], shape (n,), component 1 first.
    about
        The point about which torques are taken [m], shape (2,), if component 1's outer hinge is at
        the origin; None for each component's own centre.

    Raises
    ------
    SceneError
        If ``scene`` is not a scene, a shape is wrong or a number exceeds `LARGEST`.
    """
    headings = checked("angles", angles, scene)
    force, torque = _smooth_state(scene, headings)[:2]
    if about is not None:
        arm = centres(headings, side=scene.casing.side) - places(
            "about", [about], "two for x and y"
        )
        torque = torque + arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    return force, torque


def energy(scene: Scene, angles: npt.ArrayLike) -> float:
    """Return the magnetic energy [J] at the given headings, counting each pair of components once.

    Pairs of pole faces within a component are omitted, because they do not depend on the shape.

    Raises
    ------
    SceneError
        If ``scene`` is not a scene, the shape is not (n,) or a number exceeds `LARGEST`.
    """
    return _smooth_state(scene, checked("angles", angles, scene))[2]


def checked(key: str, values: npt.ArrayLike, scene: Scene, *, stacked: bool = False) -> Floats:
    """Return numbers up to `LARGEST` of shape (n,), or (..., n) if ``stacked``; refuse others.

    The scene has n components; an argument that is not a scene is refused too.
    """
    errors.refuse(unless_a_scene(scene))
    n = scene.n
    array = numbers(values)
    if array is None:
        raise SceneError([Problem(key, values, f"must be {n} numbers")])
    if array.shape[-1:] != (n,) or (array.ndim > 1 and not stacked):
        wanted = f"(..., {n})" if stacked else f"({n},)"
        raise SceneError([Problem(key, array.shape, f"must have shape {wanted}")])
    if not (np.abs(array) <= LARGEST).all():
        allowed = f"must be finite and from {-LARGEST:g} to {LARGEST:g}"
        raise SceneError([Problem(key, array.tolist(), allowed)])
    return array


def numbers(values: Any) -> Floats | None:
    """Return numbers as a new array, or None if any value is not a number."""
    with suppress(TypeError, ValueError, OverflowError):
        given: Any = np.asarray(values)
        # NumPy would drop imaginary parts and read texts.
        return given.astype(np.float64, casting="unsafe" if given.dtype == object else "same_kind")
    return None


def places(key: str, values: Any, allowed: str) -> Floats:
    """Return positions [m] of shape (k, 2); refuse other shapes and numbers that are not finite."""
    array = numbers(values)
    if array is None or array.ndim != 2 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise SceneError([Problem(key, values, f"must be finite numbers, {allowed}")])
    return array


def _generator(seed: int | np.random.Generator) -> np.random.Generator:
    """Return the generator for a seed; a generator is returned unchanged."""
    if isinstance(seed, np.random.Generator):
        return seed
    errors.refuse(errors.unless_whole("seed", seed, 0))
    return np.random.default_rng(seed)


def _smooth_state(scene: Scene, angles: Floats) -> tuple[Floats, Floats, float]:
    """Return the magnet forces (n, 2) [N], torques (n,) [N·m] and energy [J]."""
    model = pack(scene.alone())
    work = new_work(model._replace(contact=False, frictional=False))
    articulated.place(0, model.bodies, np.append(angles, [0.0, 0.0]), work.pose)
    if model.magnetic:
        add_magnet_forces(0, model, work.pose, work.nodes, work.loads)
    energy = magnet_energy(0, model, work)
    force = np.stack([work.loads.fx, work.loads.fy], axis=1)
    return force, work.loads.torque, energy
