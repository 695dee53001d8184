"""Tests of free chains: constant momenta, reversible motion, and exact rest."""

import math

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.along_folds import SteppedSession
from magfold_bench.laws.mechanics import kinetic_energy, momenta
from magfold_bench.laws.random_scenes import LARGEST, SMALLEST, random_scene, random_sequence
from magfold_env.engine import indices as ix
from magfold_env.shapes import centres

pytestmark = pytest.mark.laws

RATES, DRIFT = 30.0, 0.3  # largest of a thrown chain [rad/s, m/s]
THROWN_FOR = 0.3  # [s]
SWINGS = 6.0  # duration of a pendulum over √(length of a component / g)
NEARLY_SHUT = 1.4  # [rad] a magnetic chain is followed until a joint is there
WAIT = 1000.0  # [s]
LEAST_FRICTION = 0.2
MANY = range(40)
MISSED = 500.0
"""Factor on the tolerance of laws that some scenes miss; docs/dynamics.md names these laws."""


class FreeSession(SteppedSession):
    """A session whose chain can continue to move freely after its run has ended."""

    def go_on(self):
        """Restart an ended run, with the full time to settle."""
        self.status, self.message = None, ""
        self._state.clock[ix.END] = self.time + self.scene.duration

    def wait(self, duration):
        """Continue for a time [s] in any status."""
        self.go_on()
        self._state.clock[ix.END] = math.inf
        self._go_on(keep=-1, until=self.time + duration)

    def throw_any(self, rng):
        """Give the chain random rates and a drift."""
        rates = rng.uniform(-RATES, RATES, self.scene.n)
        self.throw(rates, rng.uniform(-DRIFT, DRIFT, 2))

    @property
    def kinetic(self):
        """Kinetic energy [J]."""
        return float(kinetic_energy(self.scene, self.angles, self.rates, self.base_velocity))

    @property
    def momenta(self):
        """Linear momentum [kg m/s], and angular momentum about the origin [kg m²/s]."""
        return momenta(self.scene, self.angles, self.rates, self.base, self.base_velocity)

    @property
    def own_momenta(self):
        """Like `momenta`, but with angular momentum about the centre of mass."""
        linear, angular = self.momenta
        masses = self.scene.masses
        places = centres(self.angles[None], self.scene.casing.side, self.base[None])[0]
        x, y = masses @ places / masses.sum()
        return linear, angular - (x * linear[1] - y * linear[0])


def thrown(seed, tolerance, *, contact):
    """Return a free chain without magnets and friction that begins with random rates."""
    rng = np.random.default_rng([seed, 1])
    n = int(rng.integers(SMALLEST, LARGEST + 1))
    scene = mf.Scene(
        sequence=("NNNN",) * n, magnets=None, friction=0.0, contact=contact, duration=THROWN_FOR,
        start_angle_spread=0.5,
    )  # fmt: skip
    session = FreeSession(scene.replace(solver={"tolerance": tolerance}).draw(rng))
    session.throw_any(rng)
    return session


def momentum_errors(seed, tolerance, *, contact):
    """Return the changes of a thrown chain's linear and angular momentum.

    Relative to √(2 · energy · mass), and to this number times the chain's length.
    """
    session = thrown(seed, tolerance, contact=contact)
    scene, before = session.scene, session.momenta
    size = float(np.sqrt(2.0 * session.kinetic * scene.masses.sum()))
    session.settle()
    after = session.momenta
    length = scene.n * scene.casing.diagonal
    linear = float(np.hypot(*(after[0] - before[0]))) / size
    return linear, float(abs(after[1] - before[1])) / (size * length)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("tolerance", "allowed"),
    [(1e-3, 1e-2), (1e-6, 1e-5), (1e-9, 1e-8), (1e-11, 1e-10), (1e-12, 1e-10)],
)
def test_a_free_chain_keeps_its_momenta(seed, tolerance, allowed):
    assert max(momentum_errors(seed, tolerance, contact=False)) <= allowed


@pytest.mark.weekly
@pytest.mark.parametrize(("tolerance", "contact", "allowed", "missed"), [
    (1e-3, False, 1e-2, 1.0),
    (1e-6, False, 1e-5, 1.0),
    (1e-12, False, 1e-10, 1.0),
    (1e-3, True, 1e-2, MISSED),
    (1e-4, True, 1e-3, 1.0),
])  # fmt: skip
def test_many_chains_keep_their_momenta(tolerance, contact, allowed, missed):
    errors = [momentum_errors(seed, tolerance, contact=contact) for seed in MANY]
    linear, angular = np.max(errors, axis=0)
    assert linear <= allowed
    assert angular <= allowed * missed


def settled(seed, **changes):
    """Throw a free chain without friction, and let it move until its time is over.

    Returns the session, and the initial values of its own momenta and its energy.
    """
    rng = np.random.default_rng(seed)
    session = FreeSession(mf.Scene(friction=0.0, **changes).draw(rng))
    session.throw_any(rng)
    before = *session.own_momenta, session.kinetic
    session.settle()
    return session, before


@pytest.mark.parametrize("seed", range(3))
def test_a_chain_of_uneven_components_keeps_momentum_and_energy(seed):
    rng = np.random.default_rng(100 + seed)
    masses, inertias = rng.uniform(0.001, 0.01, 6), rng.uniform(2e-8, 2e-7, 6)
    casing = {"mass": masses.tolist(), "inertia": inertias.tolist()}
    session, (linear, spin, energy) = settled(
        seed, sequence=("NSNS",) * 6, casing=casing, magnets=None, contact=False, duration=0.5,
        solver={"tolerance": 1e-9},
    )  # fmt: skip
    assert session.time == pytest.approx(0.5)
    assert session.kinetic == pytest.approx(energy, rel=1e-7)
    size = masses.sum() * 1.0  # a metre a second
    assert session.own_momenta[0] == pytest.approx(linear, abs=1e-8 * size)
    assert session.own_momenta[1] == pytest.approx(spin, abs=1e-8 * size * 0.1)


@pytest.mark.parametrize("contact", [False, True])
def test_momentum_is_kept_to_rounding_at_any_tolerance(contact):
    session, (linear, spin, _) = settled(
        5, sequence=("NSNS", "SNNS", "NNSS", "SSNS"), contact=contact, duration=0.05,
        solver={"tolerance": 1e-2},
    )  # fmt: skip
    length = session.scene.n * session.scene.casing.diagonal
    size = session.scene.masses.sum() * RATES * length
    np.testing.assert_allclose(session.own_momenta[0], linear, atol=1e-11 * size)
    assert session.own_momenta[1] == pytest.approx(spin, abs=1e-11 * size * length)


@pytest.mark.parametrize("heavy", [0, -1])
def test_a_component_a_million_times_heavier_is_not_carried_away(heavy):
    masses = np.full(4, 1e-6)
    masses[heavy] = 1.0
    scene = mf.Scene(
        sequence=("NSNS",) * 4, casing=mf.Casing(mass=tuple(masses.tolist())), magnets=None,
        friction=0.0, contact=False, duration=0.5,
    )  # fmt: skip
    rng = np.random.default_rng(6)
    session = FreeSession(scene.draw(rng))
    session.throw(rng.uniform(-RATES, RATES, 4))
    before = session.kinetic
    session.settle()
    assert session.kinetic == pytest.approx(before, rel=1e-2)


def reversal_error(kind, seed, tolerance):
    """Return the distance from the start after a chain's motion was reversed [rad].

    Positions are in lengths of a component. There is no contact and no friction.
    """
    if kind == "thrown":
        session = thrown(seed, tolerance, contact=False)
    else:
        session = FreeSession(smooth(kind, seed, tolerance))
    angles, base = session.angles, session.base
    for _ in range(2):
        session.go_on()
        session.settle()
        session.throw(-session.rates, -session.base_velocity)
    turned = np.abs(session.angles - angles).max()
    moved = np.hypot(*(session.base - base)) / session.scene.casing.diagonal
    return float(max(turned, moved))


def smooth(kind, seed, tolerance):
    """Return a chain that swings or is bent by magnets, with a duration of smooth motion."""
    rng = np.random.default_rng([seed, 2])
    n = int(rng.integers(SMALLEST, LARGEST + 1))
    scene = mf.Scene(sequence=random_sequence(rng, n), friction=0.0).draw(rng)
    scene = scene.replace(solver={"tolerance": tolerance}, contact=False)
    if kind == "pendulum":
        return scene.replace(
            mount="pinned", magnets=None, gravity={"in_plane": (0.0, -9.8)},
            duration=SWINGS * float(np.sqrt(scene.casing.diagonal / 9.8)),
        )  # fmt: skip
    # Until a joint comes near its stop for the first time.
    path = mf.simulate(scene.replace(duration=0.1), frame_rate=2000.0).trajectory
    assert path is not None
    shut = np.flatnonzero(np.abs(np.diff(path.angles, axis=1)).max(axis=1) > NEARLY_SHUT)
    return scene.replace(duration=float(path.time[shut[0] if shut.size else -1]))


@pytest.mark.parametrize("kind", ["thrown", "pendulum"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("seed", range(3))
def test_a_film_run_backwards_ends_at_its_start(seed, tolerance, kind):
    assert reversal_error(kind, seed, tolerance) <= tolerance


@pytest.mark.weekly
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("kind", ["thrown", "pendulum", "magnetic"])
def test_many_films_run_backwards_end_at_their_start(kind, tolerance):
    missed = kind == "magnetic" or (kind, tolerance) == ("thrown", 1e-3)
    worst = np.max([reversal_error(kind, seed, tolerance) for seed in MANY])
    assert worst <= tolerance * (MISSED if missed else 1.0)


def creep(seed):
    """Return the distance that a fold at rest moves in a thousand seconds [rad].

    Positions are in lengths of a component. None if the scene never comes to rest.
    """
    scene = random_scene(seed)
    scene = scene.replace(friction=np.maximum(scene.frictions, LEAST_FRICTION))
    session = FreeSession(scene)
    session.settle()
    if session.status not in {mf.FoldStatus.FOLDED, mf.FoldStatus.MISFOLDED}:
        return None
    angles, base = session.angles, session.base
    session.wait(WAIT)
    moved = float(np.abs(session.base - base).max()) / scene.casing.diagonal
    return max(float(np.abs(session.angles - angles).max()), moved)


@pytest.mark.parametrize("seed", [3, 5, 11, 16, 21])
def test_what_friction_holds_does_not_move_by_a_bit(seed):
    assert creep(seed) == 0.0


@pytest.mark.weekly
def test_many_chains_do_not_creep():
    assert {creep(seed) for seed in MANY} <= {0.0, None}
