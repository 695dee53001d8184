"""Tests of energies along recorded folds, against the session's values and physical laws."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws import mechanics
from magfold_bench.laws.along_folds import SteppedSession
from magfold_env.fold import kinetic_energy, loaded, turns
from magfold_env.simulation.frames import magnetic_energy
from magfold_env.simulation.session import Session

SEQUENCE = ("SNNS", "NNSN", "SSSN", "----", "SSSS", "N-SN")
MAGNET = mf.FixedMagnet(position=(0.05, 0.1), width=0.03, height=0.03, thickness=0.02)
FIELD = mf.Field(uniform=(1e-3, 2e-3), magnet=MAGNET)


def _scene(**changes: object) -> mf.Scene:
    scene = mf.Scene(sequence=SEQUENCE, duration=0.1).replace(feed={"speed": 0.4})
    return scene.replace(**changes).draw(np.random.default_rng(0))


def _steps(scene: mf.Scene) -> tuple[mf.Trajectory, np.ndarray]:
    """Return some states of a run, and their magnetic energies."""
    rows: list[tuple[object, ...]] = []

    def look(s: Session) -> None:
        seen = (s.time, s.angles, s.base, s.rates, s.released, s.base_velocity, 0.0, s.energy())
        rows.append(seen)

    SteppedSession(scene, look, stride=3).settle()
    *motion, energy = (np.array(column) for column in zip(*rows, strict=True))
    return mf.Trajectory(*motion, side=scene.casing.side), energy


@pytest.mark.parametrize("field", [None, FIELD])
@pytest.mark.parametrize("mount", ["pinned", "free", "forward", "backward"])
def test_energies_are_those_of_the_run(mount: str, field: mf.Field | None) -> None:
    tube = mount in ("forward", "backward")
    changes = {"mount": "tube", "feed": {"direction": mount}} if tube else {"mount": mount}
    scene = _scene(**changes, field=field)
    motion, magnetic = _steps(scene)
    found = magnetic_energy(scene, motion)
    np.testing.assert_allclose(found, magnetic, rtol=1e-9, atol=1e-15)
    rows = zip(motion.angles, motion.rates, motion.base_velocity, strict=True)
    expected = [mechanics.kinetic_energy(scene, *row) for row in rows]
    np.testing.assert_allclose(kinetic_energy(scene, motion), expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_magnets_loaded_at_the_mouth_act_from_there(direction: str) -> None:
    n = len(SEQUENCE)
    feed = {"direction": direction, "loading": "at_mouth"}
    scene = _scene(mount="tube", feed=feed)
    released = np.arange(n + 1)
    angles = np.random.default_rng(1).uniform(-0.3, 0.3, (n + 1, n))
    # The next to leave is a little on its way.
    along = scene.casing.diagonal * np.cos(angles)
    inside = released if direction == "forward" else n - released
    base = np.zeros((n + 1, 2))
    base[:, 0] = [1e-3 - row[:count].sum() for row, count in zip(along, inside, strict=True)]
    still = {
        "rates": 0.0 * angles,
        "base_velocity": 0.0 * base,
        "push": np.zeros(n + 1),
        "side": 0.0125,
    }
    motion = mf.Trajectory(np.linspace(0.0, 0.5, n + 1), angles, base, released=released, **still)
    order = range(n) if direction == "forward" else range(n)[::-1]
    found = magnetic_energy(scene, motion)
    for out in released:
        magnetic = list(order)[: out + 1]
        faces = tuple(f if k in magnetic else "----" for k, f in enumerate(SEQUENCE))
        expected = mf.energy(scene.replace(sequence=faces, mount="free"), angles[out])
        assert found[out] == pytest.approx(expected, rel=1e-12, abs=1e-18)
        assert set(np.flatnonzero(loaded(scene, angles, base, released)[out])) == set(magnetic)


def test_turns_are_the_order_of_the_feed() -> None:
    forward = _scene(mount="tube")
    np.testing.assert_array_equal(turns(forward), range(6))
    np.testing.assert_array_equal(
        turns(forward.replace(feed={"direction": "backward"})), range(6)[::-1]
    )
