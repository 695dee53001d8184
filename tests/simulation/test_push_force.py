from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.simulation.session import Session
from magfold_env.simulation.view import ChainState

SEQUENCE = ("NNNS", "NSSS", "NNNS", "SSNN", "SNNN", "SSSN")
INTERVAL = 0.02


def scene_of(**changes: Any) -> mf.Scene:
    scene = mf.load_scene("tube-built").replace(sequence=SEQUENCE, start_angles=(0.0,) * 5)
    return scene.replace(**changes)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_to_push_a_straight_chain_takes_the_drag_of_what_is_outside(direction: str) -> None:
    scene = scene_of(magnets=None, feed={"direction": direction})
    session = Session(scene)
    drag = scene.frictions[0] * scene.gravity.normal * scene.masses[0]
    assert session.push_force() == 0.0
    pushes = 0
    while session.released < session.n - 1:
        session.push(np.full(6, 0.1), 0.013)
        if session.released > 0 and session.push_force() != 0.0:
            assert session.push_force() == pytest.approx(drag * session.released)
            pushes += 1
    assert pushes > 10


@pytest.mark.parametrize("loading", ["preloaded", "at_mouth"])
def test_the_push_does_the_work_that_the_energies_gain(loading: str) -> None:
    # Without friction nothing is lost but in impacts: between them the balance is exact.
    scene = scene_of(
        friction=0.0,
        start_angles=(0.01, -0.02, 0.03, 0.01, -0.01),
        feed={"loading": loading},
        magnets={"remanence": 0.1},
        solver={"tolerance": 1e-9},
    )
    session = Session(scene)
    speed, interval = 0.1, 5e-5
    session.push(np.full(6, speed), 1.2 * scene.casing.diagonal / speed)
    assert session.released == 1

    def energy() -> float:
        masses, inertias = scene.masses[0], scene.inertias[0]
        state = ChainState(session.angles, session.rates, session.base, session.base_velocity)
        velocities = state.velocities(scene.casing.side)[: session.released]
        rates = state.rates[: session.released]
        kinetic = 0.5 * masses * np.sum(velocities**2) + 0.5 * inertias * np.sum(rates**2)
        return float(kinetic) + session.potential()

    before, work, force = energy(), 0.0, session.push_force()
    for _ in range(60):
        session.push(np.full(6, speed), interval)
        after = session.push_force()
        work += 0.5 * (force + after) * speed * interval
        force = after
    assert session.released == 1
    gained = energy() - before
    assert abs(gained) > 1e-8
    assert work == pytest.approx(gained, rel=1e-3)


def test_to_measure_a_force_changes_nothing() -> None:
    sessions = [Session(scene_of(start_angles=(0.01,) * 5)) for _ in range(2)]
    for _ in range(40):
        for session in sessions:
            session.push(np.full(6, 0.2), INTERVAL)
        sessions[0].push_force()
        np.testing.assert_array_equal(sessions[0].angles, sessions[1].angles)
        np.testing.assert_array_equal(sessions[0].rates, sessions[1].rates)
