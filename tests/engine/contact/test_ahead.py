"""Tests of bounds on whether a rigidly moving chain may meet a solid, against motions."""

import numpy as np
import pytest

from magfold_bench.laws.overlap import depths
from magfold_env.engine.contact import ahead
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Rectangle, Scene
from magfold_env.scene.numbers import FRICTION_ARM
from magfold_env.shapes import centres
from magfold_env.simulation.pack import pack

CASES = 150
HELD_BY = 0.05  # friction


def drawn(rng, n, **changes):
    """Return a scene with a post, and a bent chain's headings, rate and base velocity."""
    # Clear of the straight start, from which nothing moves here.
    place = rng.uniform(-0.1, 0.1), rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.1)
    post = Rectangle(position=place, size=(0.01, 0.02), heading=rng.uniform(-3.0, 3.0))
    scene = Scene(
        sequence=("NNNN",) * n, magnets=None, friction=0.0, obstacles=(post,),
        start_angles=(0.0,) * (n - 1), **changes,
    )  # fmt: skip
    headings = rng.uniform(-np.pi, np.pi) + np.cumsum(rng.uniform(-1.5, 1.5, n))
    return scene, headings, rng.uniform(-8.0, 8.0), rng.uniform(-0.4, 0.4, 2)


def may_meet(scene, headings, rate, velocity):
    """Return the engine's answer for a chain whose outer hinge is at the origin."""
    model = pack(scene)
    state, work = new_state(model, headings), new_work(model)
    state.v[:] = [*[rate] * scene.n, *velocity]
    return ahead.may_meet_solid(model, state, work)


def meets(scene, headings, turns, bases):
    """Return the poses of a rigid motion in which the chain overlaps the post."""
    angles = headings + turns[:, None]
    return depths(scene, angles, bases, np.full(len(turns), scene.n)).solids.max(axis=1) > 0.0


def assert_foreseen(motions):
    """Check the engine's answers against motions that begin outside the post."""
    found = [(may_meet(*chain), bool(met.any())) for chain, met in motions if not met[0]]
    assert all(answer for answer, met in found if met)
    # An engine that always answers "yes" would pass the check above.
    assert sum(not answer for answer, _ in found) > CASES / 10
    assert sum(met for _, met in found) > CASES / 30


@pytest.mark.parametrize("pull", [0.0, 3.0])
def test_a_flight_that_meets_a_solid_is_foreseen(pull):
    rng, time = np.random.default_rng(5), np.linspace(0.0, 1.0, 401)

    def motions():
        for _ in range(CASES):
            down = pull * np.array([np.cos(angle := rng.uniform(-3, 3)), np.sin(angle)])
            gravity = {"in_plane": tuple(down)}
            chain = drawn(rng, rng.integers(1, 5), mount="free", gravity=gravity)
            scene, headings, rate, velocity = chain
            place = centres(headings[None], scene.casing.side, np.zeros((1, 2)))[0].mean(axis=0)
            c, s = np.cos(rate * time), np.sin(rate * time)
            # The centre of mass flies freely, and the base turns about it.
            flies = velocity + rate * np.array([-place[1], place[0]])
            mass = place + flies * time[:, None] + 0.5 * down * time[:, None] ** 2
            arm = np.stack([c * place[0] - s * place[1], s * place[0] + c * place[1]], axis=1)
            yield chain, meets(scene, headings, rate * time, mass - arm)

    assert_foreseen(motions())


def test_a_slide_that_meets_a_solid_is_foreseen():
    rng, step = np.random.default_rng(6), 1e-3

    def motions():
        for _ in range(CASES):
            scene, headings, rate, velocity = drawn(rng, 1, mount="free")
            scene = scene.replace(friction=HELD_BY)
            side = scene.casing.side
            reach, arm = side / np.sqrt(2), FRICTION_ARM * side
            most = HELD_BY * scene.gravity.normal
            direction = np.array([np.cos(headings[0]), np.sin(headings[0])])
            place, turn, spin = reach * direction, 0.0, rate
            moving = velocity + spin * reach * np.array([-direction[1], direction[0]])
            turns, bases = [], []
            inertia = scene.inertias[0] / scene.masses[0]
            for _ in range(2000):
                across = headings[0] + turn
                turns.append(turn)
                bases.append(place - reach * np.array([np.cos(across), np.sin(across)]))
                slip = np.hypot(np.hypot(*moving), arm * spin)
                if slip < most * step:
                    break
                moving = moving - step * most * moving / slip
                spin -= step * most * arm**2 * spin / slip / inertia
                place, turn = place + step * moving, turn + step * spin
            yield (
                (scene, headings, rate, velocity),
                meets(scene, headings, np.array(turns), np.array(bases)),
            )

    assert_foreseen(motions())


def test_what_turns_about_a_pin_comes_to_all_around_it():
    rng, turns = np.random.default_rng(7), np.linspace(0.0, 2.0 * np.pi, 361)

    def motions():
        for _ in range(CASES):
            scene, headings, rate, _ = drawn(rng, rng.integers(1, 5), mount="pinned")
            chain = scene, headings, rate, np.zeros(2)
            yield chain, meets(scene, headings, turns, np.zeros((len(turns), 2)))

    assert_foreseen(motions())


def test_nothing_is_met_where_there_is_no_solid():
    scene, headings, rate, velocity = drawn(np.random.default_rng(8), 3, mount="free")
    assert not may_meet(scene.replace(obstacles=()), headings, rate, velocity)
