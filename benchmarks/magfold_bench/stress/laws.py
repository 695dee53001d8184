"""The laws that every scene of any kind must satisfy.

Bounds are relative to the scene: to its side, the range of its energies, or its tolerance.
"""

import math

import numpy as np

from magfold_bench.laws import mechanics
from magfold_bench.laws.along_folds import Motion, follow
from magfold_bench.laws.dense import Inside, look_inside
from magfold_bench.laws.overlap import deepest_overlap, depths
from magfold_bench.stress.symmetries import OTHER_END, check_symmetries, faces
from magfold_bench.stress.verdict import Verdict
from magfold_env.engine.magnets.laws import COULOMB
from magfold_env.fold import Fold, FoldStatus
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word, headings
from magfold_env.simulation.simulate import energy, simulate

LOOKS = 10_000  # largest number of states of a run that are kept

SETTLED = (FoldStatus.FOLDED, FoldStatus.MISFOLDED)
STOPPED = (FoldStatus.HELD, FoldStatus.JAMMED)
REFUSAL = "overlap at the start"
USUAL = 1e-4  # [rad] the default tolerance
DEEPEST, THINNEST = 1e-3, 1e-2  # allowed overlaps then: of the side, and of a solid's thickness
SURELY, HARDLY = 2e-3, 5e-4  # overlaps that must be refused, and that must not; 1e-3 is the bound
WITHIN = 1e-9  # of the side: how far held casings may extend beyond the bore
LEAST = 1e-7  # [rad] beyond a stop, at the tightest tolerances
ROUNDING = 1e-12  # of an energy
FOLDED_WITHIN = 0.05  # [rad] of a right angle
AT_REST = 1e-3  # largest rate at rest, in tolerances per second
LEAST_SHARES, MOST_SHARES = 10.0, 100.0  # allowed rise of energy, in tolerances times its range
A_STEP = 0.05  # allowed rise per step in this unit; a step may use up 0.1
LEFT = 0.5  # share of an error above the bound that may remain at a tenth of the tolerance
FLOOR = 1e-8  # of energy and momenta, at the tightest tolerances: errors of contacts
FLOOR_A_STEP = 1e-11  # of energy, per step: joints within 1e-9 rad of a stop are moved to it
PAIR = 1e-4  # relative to the energy of two full charges a side apart


def check(scene: Scene) -> Verdict:
    """Simulate a concrete scene and check every law."""
    verdict = Verdict()
    # For the paper's solver, only the reported numbers at the end are checked.
    paper = scene.solver.method == "paper"
    stride = scene.solver.max_steps if paper else max(1, scene.solver.max_steps // LOOKS)
    motion, session = follow(scene, stride)
    stepped, fold = session.fold(), simulate(scene)
    inside, recorded = look_inside(scene)
    verdict.status, verdict.message = fold.status.value, fold.message
    same = identical(stepped, fold)
    verdict.require("determinism", same, "another run, stopped at every step, ends differently")
    same = np.array_equal(recorded.angles, fold.angles, equal_nan=True)
    verdict.require("determinism", same, "another run, recorded on the way, ends differently")
    check_refusal(scene, fold, verdict)
    if fold.status is FoldStatus.FAILED:
        if paper:
            verdict.notes.append("blown up by the paper's solver")
            verdict.require("finite", is_finite(fold), "a value is not finite")
        return verdict
    verdict.require("finite", motion.finite and is_finite(fold), "a value is not finite")
    if not motion.finite:
        return verdict
    check_status(fold, motion, verdict)
    if paper:
        return verdict
    check_inside(scene, inside, verdict)
    check_energies(motion, verdict)
    check_rest(fold, motion, verdict)
    check_symmetries(scene, fold, verdict)
    return verdict


def identical(one: Fold, other: Fold) -> bool:
    """Return whether two folds are equal, bit for bit."""
    return all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True)
        for name in ("angles", "base", "energy", "time", "steps", "evaluations")
    ) and (one.status, one.message, one.word) == (other.status, other.message, other.word)


def is_finite(fold: Fold) -> bool:
    """Return whether all numbers at the end are finite."""
    values = np.concatenate([fold.angles, fold.base, [fold.energy, fold.time]])
    return bool(np.isfinite(values).all())


def check_refusal(scene: Scene, fold: Fold, verdict: Verdict) -> None:
    """Check that overlapping starts are refused, others accepted, and that no run breaks down."""
    refused = fold.status is FoldStatus.FAILED and REFUSAL in fold.message
    if scene.contact and scene.mount != "tube" and scene.solver.method == "adaptive":
        assert scene.start_angles is not None
        start = headings(scene.start_angles)
        deep = deepest_overlap(scene.replace(mount="free", field=None), start, np.zeros(2), scene.n)
        deep /= scene.casing.side
        words = f"squares overlap by {deep:.3g} at the start"
        verdict.require("refusal", refused or deep < SURELY, words)
        verdict.require("refusal", not refused or deep > HARDLY, words)
    if not refused and not poles_meet(scene):
        gave_up = fold.status is FoldStatus.FAILED
        verdict.require("no breakdown", not gave_up, fold.message)


def poles_meet(scene: Scene) -> bool:
    """Return whether poles may pass through each other, where forces are unbounded.

    Only contact keeps poles apart, and the paper's solver has no contact.
    """
    solid = scene.contact and scene.solver.method == "adaptive"
    return scene.magnets is not None and not solid


def check_inside(scene: Scene, inside: Inside, verdict: Verdict) -> None:
    """Check that no body penetrates or crosses another, and that joints stay within their stops."""
    tolerance = scene.solver.tolerance
    if scene.contact:
        loose = max(1.0, tolerance / USUAL)
        verdict.bound("no penetration", inside.casings, DEEPEST * loose, "casings")
        verdict.bound("no penetration", inside.solids, DEEPEST * loose, "solids")
        verdict.bound("no penetration", inside.thin, THINNEST * loose, "share of a thickness")
        verdict.require("no crossing", inside.crossings == 0, f"{inside.crossings} times")
        verdict.bound("joint stops", inside.past_stop, max(LEAST, tolerance))
    if scene.mount == "tube":
        # Components that are drawn back in stay where contacts left them.
        allowed = WITHIN if scene.feed.schedule is None else DEEPEST
        verdict.bound("held within the bore", inside.beyond_bore, allowed)


def check_energies(motion: Motion, verdict: Verdict) -> None:
    """Check that neither energy nor momentum appears from nowhere."""
    scene = motion.scene
    if poles_meet(scene):
        verdict.notes.append("poles that meet")
    else:
        check_passivity(motion, verdict)
    alone = not scene.solids and scene.bumps is None
    if scene.mount == "free" and not scene.frictions.any() and alone:
        check_momentum(motion, verdict)


def check_passivity(motion: Motion, verdict: Verdict) -> None:
    """Check that energy comes only from work on the chain and is lost only to friction and impacts.

    An error above the bound must come from the step size: with a tenth of the tolerance, little of
    it may remain.
    """
    tolerance = motion.scene.solver.tolerance
    many = min(max(LEAST_SHARES, A_STEP * len(motion.time)), MOST_SHARES)
    allowed = max(many * tolerance, FLOOR, FLOOR_A_STEP * len(motion.time))
    errors = energy_errors(motion, allowed)
    left: dict[tuple[str, str], float] = {}
    if allowed < max(errors.values()) <= MOST_SHARES * tolerance:
        finer, _ = follow(motion.scene.replace(solver={"tolerance": 0.1 * tolerance}))
        left = energy_errors(finer, allowed)
    for (law, words), error in errors.items():
        if error > allowed and left:
            told = f"{words} at a tenth of the tolerance".strip()
            verdict.bound(law, left[law, words], LEFT * error, told)
        else:
            verdict.bound(law, error, allowed, words)


def energy_errors(motion: Motion, least: float) -> dict[tuple[str, str], float]:
    """Return unexpected rises and falls of energy, by law and problem.

    They are relative to the largest of three values in the run: the range of the energy, the range
    of the work, and the kinetic energy. The energy of slow motions is less exact, because rates are
    exact only to a share of their typical size. Values below ``least`` count as rounding.
    """
    own, kept = motion.own, motion.own + motion.impacts
    terms = (motion.potential, motion.kinetic, motion.total, motion.work, motion.impacts)
    rounding = ROUNDING * max(float(np.abs(term).max()) for term in terms)
    moving = float(motion.kinetic.max())
    usual = math.sqrt(moving * pair_energy(motion.scene))
    ranges = (float(np.ptp(each)) for each in (own, motion.work))
    extent = max(*ranges, moving, usual, rounding / least, 1e-300)
    found = {
        ("passivity", ""): rise(own) / extent,
        ("energy account", "more went into impacts"): rise(kept) / extent,
    }
    if not motion.scene.frictions.any():
        found["energy account", "less went into impacts"] = rise(-kept) / extent
    return found


def rise(values: np.ndarray) -> float:
    """Return the largest rise of a value above an earlier one."""
    return float((values - np.minimum.accumulate(values)).max())


def pair_energy(scene: Scene) -> float:
    """Return the energy [J] of two nominal charges one side length apart, or 0 without magnets."""
    if scene.magnets is None:
        return 0.0
    return COULOMB * scene.magnets.charge**2 / scene.casing.side


def touches_solid(fold: Fold) -> bool:
    """Return whether a component touches a solid at the end."""
    released = np.array([fold.scene.n])
    return bool(depths(fold.scene, fold.angles[None], fold.base[None], released).solids.any())


def check_momentum(motion: Motion, verdict: Verdict) -> None:
    """Check that a chain that starts at rest without external forces gains no momentum."""
    scene = motion.scene
    outer = scene.field is not None and scene.field.any
    linear, angular = mechanics.momenta(
        scene, motion.angles, motion.rates, motion.base, motion.base_velocity
    )
    mass = float(scene.masses.sum())
    weight = mass * np.array(scene.gravity.in_plane)
    length = scene.n * scene.casing.diagonal
    # An error in a rate affects everything beyond that joint.
    size = mass * length * float(np.abs(motion.rates).max())
    if outer or size == 0.0:
        return
    allowed = max(10.0 * scene.solver.tolerance, FLOOR)
    off = np.hypot(*(linear - motion.time[:, None] * weight).T).max()
    verdict.bound("momentum", float(off) / size, allowed)
    if not weight.any():
        spin = float(np.abs(angular).max())
        verdict.bound("angular momentum", spin / (size * length), allowed)


def check_status(fold: Fold, motion: Motion, verdict: Verdict) -> None:
    """Check that the status is correct, and that the message names the limit that was reached."""
    scene, solver = fold.scene, fold.scene.solver
    off = np.abs(np.abs(fold.joint_angles) - np.pi / 2.0)
    shut = bool((off <= FOLDED_WITHIN).all())
    word = angles_to_word(fold.joint_angles)
    verdict.require("status", fold.word == word, f"the word is {word}")
    verdict.bound("work cap", float(fold.steps), float(solver.max_steps))
    if fold.status in SETTLED:
        told = fold.status is FoldStatus.FOLDED
        verdict.require("status", told == shut, "said to fold" if told else "said to misfold")
        return
    inside = scene.n - int(motion.released[-1])
    if fold.status in STOPPED:
        verdict.require("status", inside > 0, "reported as held by an empty tube")
        return
    if "are the limit" in fold.message:
        a_second = "a second are the limit" in fold.message
        most = solver.max_steps_per_second if a_second else solver.max_steps
        verdict.require("status", fold.steps >= most, "reported a limit that was not reached")
    else:
        out = motion.released == scene.n
        fed = float(motion.time[~out].max(initial=0.0)) if inside == 0 else 0.0
        late = fold.time >= (fed + scene.duration) * (1.0 - 1e-9)
        verdict.require("status", late, "reported as out of time but is not")


def energy_as_simulated(scene: Scene, angles: np.ndarray) -> float:
    """Return the energy of a chain whose components are numbered as in the simulation [J].

    Their order decides which of two near faces is integrated in closed form, which changes the
    energy within the magnets' accuracy. A forward feed holds component n, which then comes first.
    """
    if scene.mount == "tube" and scene.feed.direction == "forward":
        backward = {"direction": "backward"}
        scene, angles = scene.replace(**faces(scene, OTHER_END, -1), feed=backward), angles[::-1]
        angles = angles + math.pi
    return energy(scene, angles)


def check_rest(fold: Fold, motion: Motion, verdict: Verdict) -> None:
    """Check that a chain reported at rest is at rest, and stays at rest if it is put down again."""
    if fold.status not in SETTLED:
        return
    scene = fold.scene
    turning = float(np.abs(np.diff(motion.rates[-1])).max(initial=0.0))
    still = AT_REST * scene.solver.tolerance
    verdict.bound("rest", turning, max(still, 1e-9), "joints turn at the end [rad/s]")
    if scene.field is None and scene.magnets is not None:
        there = energy_as_simulated(scene, fold.angles)
        # The energies of pairs may cancel; then, rounding is relative to the energy of one pair.
        unit = max(abs(there), PAIR * pair_energy(scene), 1e-300)
        verdict.bound("energy", abs(fold.energy - there) / unit, 1e-9)
    outside = scene.field is not None or any(scene.gravity.in_plane)
    if scene.mount == "tube" or outside or touches_solid(fold):
        return
    joints = np.clip(fold.joint_angles, -np.pi / 2.0, np.pi / 2.0)
    # The angles do not determine where the chain lies among obstacles.
    again = simulate(scene.replace(start_angles=joints, bumps=None, obstacles=()))
    moved = float(np.abs(again.joint_angles - joints).max(initial=0.0))
    verdict.bound("rest again", moved, 1e-6, f"put down again [rad], then {again.message}")
