"""Random scenes that a page supports, and their form for its script and its kernels."""

import math
from typing import Any, get_args

import numpy as np

import magfold_env as mf
from magfold_env.browser import memory, settings, states
from magfold_env.engine.state import Magnets
from magfold_env.scene.magnets import Length
from magfold_env.simulation.pack import pack, reversed_inside

LENGTHS = get_args(Length)
MOUNTS = ("tube", "free", "pinned")


def random_scene(rng: np.random.Generator, mount: str | None = None, **changes: Any) -> mf.Scene:
    """Return a concrete scene of 2 to 12 components, or of ``n``."""
    n = changes.pop("n", None) or int(rng.integers(2, 13))
    letters = list("NS" if rng.random() < 0.7 else "NS-")
    feed: Any = {
        "direction": str(rng.choice(["forward", "backward"])),
        "loading": str(rng.choice(["preloaded", "preloaded", "at_mouth"])),
        "speed": rng.uniform(0.1, 0.6, n) if rng.random() < 0.3 else float(rng.uniform(0.1, 0.6)),
        "force_limit": None if rng.random() < 0.2 else 20.0,
    }
    casing: Any = {}
    if rng.random() < 0.4:
        casing["mass"] = 0.0037 * rng.uniform(0.5, 1.5, n)
    magnets: Any = {"remanence": float(rng.uniform(0.3, 1.0))}
    if rng.random() < 0.2:
        magnets["remanence"] = rng.uniform(0.3, 1.0, (n, 4))
    chosen: Any = mount or str(rng.choice(MOUNTS))
    floor: Any = float(rng.choice([0.0, 0.05, 0.2, 0.35]))
    if rng.random() < 0.2:
        floor = rng.uniform(0.0, 0.4, n)
    scene = mf.Scene(
        sequence=tuple("".join(rng.choice(letters, 4)) for _ in range(n)), mount=chosen, feed=feed,
        friction=floor, casing=casing, magnets=magnets, duration=2.0,
    )  # fmt: skip
    return scene.replace(**changes).draw(rng)


def random_sizes(rng: np.random.Generator) -> dict[str, Any]:
    """Return sizes of a casing and its magnets, which fit and sometimes touch the wall."""
    side, inset = rng.uniform(0.006, 0.03), rng.choice([0.0, rng.uniform(0.0, 0.1)])
    thickness = rng.uniform(0.05, 0.3)
    width = rng.uniform(0.15, 1.0) * (1.0 - 2.0 * (inset + thickness))
    lengths = dict(zip(LENGTHS, (width, rng.uniform(0.1, 1.0), thickness, inset), strict=True))
    return {
        "casing": {"side": float(side), "corner_radius": float(side * rng.uniform(1e-4, 0.02))},
        "magnets": {name: float(side * length) for name, length in lengths.items()},
    }


def told(scene: mf.Scene) -> dict[str, Any]:
    """Return the entries of a concrete scene that a page's script needs."""
    data = scene.model_dump(mode="json")
    names = ("sequence", "mount", "friction", "duration")
    found = {name: data[name] for name in names}
    found["feed"] = {
        name: data["feed"][name]
        for name in ("direction", "speed", "loading", "force_limit", "bore", "wall")
    }
    found["magnets"] = {name: data["magnets"][name] for name in ("remanence", *LENGTHS)}
    found["casing"] = {name: data["casing"][name] for name in ("side", "mass", "corner_radius")}
    found["gravity"] = {"normal": data["gravity"]["normal"]}
    found["obstacles"] = data["obstacles"]
    name = "start_offsets" if scene.mount == "tube" else "start_angles"
    found[name] = data[name]
    return found


def couplings_of() -> tuple[Magnets, states.Couplings]:
    """Return a page's magnets, and an empty table of components' interactions on the lattice."""
    standard = memory.standard(2)
    magnets, diagonal = pack(standard).magnets, standard.casing.diagonal
    return magnets, states.new_couplings(magnets, diagonal, memory.LENGTHS[-1])


def chain_of(
    scene: mf.Scene, given: tuple[Magnets, states.Couplings] | None = None
) -> memory.Chain:
    """Return a chain of standard sizes, made from its settings."""
    standard = memory.standard(scene.n)
    chain = memory.chain_of(standard, *(given or couplings_of()))
    given_ = chain.settings
    poles = {"N": 1, "S": -1, "-": 0}
    assert scene.magnets is not None
    given_.pole[:] = [[poles[face] for face in faces] for faces in scene.sequence]
    given_.remanence[:] = scene.magnets.remanence
    order = -1 if reversed_inside(scene) else 1
    chain.model.bodies.mass[:] = scene.masses[::order]
    given_.friction[:] = scene.frictions[::order]
    chain.state.speed[:] = scene.speeds[::order]
    tube = scene.mount == "tube"
    start: Any = scene.start_offsets if tube else scene.start_angles
    given_.start[0, : len(start)] = start[::order]
    for row, each in zip(given_.obstacles, scene.obstacles, strict=False):
        row[:] = *each.position, *each.size, each.heading
    given_.choice[:] = (
        settings.MOUNTS.index(scene.mount), scene.feed.direction == "forward",
        scene.feed.loading == "at_mouth", len(scene.obstacles),
    )  # fmt: skip
    limit = math.inf if scene.feed.force_limit is None else scene.feed.force_limit
    given_.number[:] = (
        scene.gravity.normal, scene.duration, limit, scene.bore, scene.feed.wall, 0.0,
        scene.solver.tolerance, scene.solver.max_steps,
    )  # fmt: skip
    settings.set_up(given_, chain.model, chain.state, chain.view)
    return chain
