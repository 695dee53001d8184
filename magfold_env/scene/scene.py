"""The scene: everything that a fold depends on except the seed, frozen and validated."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, Self, cast

import numpy as np
from markupsafe import Markup
from pydantic import AfterValidator, BeforeValidator, Strict, model_validator
from pydantic import Field as Limits

from magfold_env.reporting.notebook import NotebookDisplay, chain_svg, facts_table
from magfold_env.reporting.page import Block
from magfold_env.scene import base, sections
from magfold_env.scene.errors import Problem, SceneError, refuse, unless_a
from magfold_env.scene.magnets import FACES, ROUNDING, Array, Magnets
from magfold_env.scene.numbers import narrowest, square_inertia
from magfold_env.scene.obstacles import Obstacles, Rectangle

SIGNS = {"N": 1.0, "S": -1.0, "-": 0.0}
"""Sign of the outward pole by the letter of a face; - stands for a face without a magnet."""

_JOINT_LIMIT = math.pi / 2
BORE = 1.05  # of a tube, in diagonals, unless given

# Ratios of mass to side³ [kg/m³] that indicate grams or milligrams instead of kilograms; that of
# gold is 2e4. Larger ratios are deliberate extremes. A mass below 0.01 kg, such as the default in
# a tiny casing, is not in grams either, because no component weighs only 10 mg.
_GRAMS = (1e6, 1e10)
_LEAST_GRAMS = 0.01


def signs(sequence: Sequence[str]) -> Array:
    """Return +1 for N, -1 for S and 0 for a face without a magnet, shape (n, 4)."""
    return np.array([[SIGNS[face] for face in faces] for faces in sequence])


def _faces(letters: str) -> str:
    if len(letters) != len(FACES) or set(letters) - set(SIGNS):
        raise ValueError(f"must be four letters N, S or - for no magnet ({', '.join(FACES)})")
    return letters


def _split(sequence: object) -> object:
    return tuple(sequence.split()) if isinstance(sequence, str) else sequence


def _some(sequence: tuple[str, ...]) -> tuple[str, ...]:
    if not sequence:
        raise ValueError("must have at least one component")
    return sequence


Component = Annotated[str, Strict(), AfterValidator(_faces)]


class Scene(base.FrozenModel, NotebookDisplay):
    """A chain, its surroundings and the settings of its simulation.

    `magfold scenes --keys` and the page "All keys of a scene" list all keys with their allowed
    values, units, defaults and meanings.

    Raises
    ------
    SceneError
        If an entry is unknown, out of range or inconsistent with others; one line per problem.

    Examples
    --------
    >>> scene = Scene(sequence=("NSNN", "NSSN"), mount="tube")
    >>> scene.replace(feed={"speed": 0.1}).feed.speed
    0.1
    """

    sequence: Annotated[tuple[Component, ...], BeforeValidator(_split), AfterValidator(_some)]
    """Outward poles of each component, component 1 first: N, S or - (none) at the faces front-left,
    back-left, back-right and front-right. A single string, "NSNN NSSN", also works."""
    casing: sections.Casing = sections.Casing()
    """The square bodies."""
    magnets: Magnets | None = Magnets()
    """The magnets, with one value for all faces or one per face; None for no magnets."""
    field: sections.Field | None = None
    """The external magnetic field; None for none."""
    mount: Literal["pinned", "free", "tube"] = "free"
    """`pinned`: component 1's outer hinge is fixed; `tube`: the chain is pushed out of a tube."""
    feed: sections.Feed = sections.Feed()
    """The tube; used only if `mount` is `tube`."""
    friction: base.Each[base.NonNegative] = 0.35
    """Coulomb coefficient between casing and floor, static and kinetic; one number, or one per
    component."""
    gravity: sections.Gravity = sections.Gravity()
    """Gravity normal to the plane and in it."""
    contact: base.Flag = True
    """Whether squares collide and joints stop at ±90°."""
    start_angle_spread: Annotated[float, Strict(), Limits(ge=0, le=0.5)] = 0.03
    """Half-width of the uniform draw of each joint angle at release [rad]; in a tube, the largest
    joint angle that results from the draw of the hinges' offsets."""
    start_angles: (
        tuple[Annotated[float, Strict(), Limits(ge=-_JOINT_LIMIT, le=_JOINT_LIMIT)], ...] | None
    ) = None
    """The n-1 joint angles at release [rad], instead of a draw. In a tube, the narrowest strip
    around the hinges is centred on the axis."""
    start_offsets: tuple[base.Number, ...] | None = None
    """Offsets of the n+1 hinges to the left of the tube's axis at release [m], component 1's outer
    hinge first, instead of start angles; used only if `mount` is `tube`."""
    obstacles: Obstacles = ()
    """Static rectangles outside the tube's bore; used only with `contact`."""
    bumps: sections.Bumps | None = None
    """Random bumps that disturb the chain; None for none."""
    spreads: sections.Spreads = sections.Spreads()
    """Half-widths of uniform draws, relative unless a unit is given; 0 means no draw."""
    solver: sections.Solver = sections.Solver()
    """Time stepping."""
    duration: base.Positive = 5.0
    """Longest simulated time [s]; with a tube, it counts from the last release."""

    @model_validator(mode="after")
    def _check_fit(self) -> Self:
        n, one = self.n, "one number, or "
        wanted = {
            "friction": (self.friction, n, f"{one}{n}, one for each component"),
            "casing.mass": (self.casing.mass, n, f"{one}{n}, one for each component"),
            "casing.inertia": (self.casing.inertia, n, f"{one}{n}, one for each component"),
            "feed.speed": (self.feed.speed, n, f"{one}{n}, one for each component"),
            "start_angles": (self.start_angles, n - 1, f"{n - 1} numbers, one for each joint"),
            "start_offsets": (self.start_offsets, n + 1, f"{n + 1} numbers, one for each hinge"),
        }
        if (magnets := self.magnets) is not None and magnets.rows is not None:
            allowed = f"{one}four, or {n} rows of four, one for each component"
            name = magnets.strength_name
            wanted[f"magnets.{name}"] = getattr(magnets, name), n, allowed
        problems = [
            Problem(key, value, f"must be {allowed}")
            for key, (value, count, allowed) in wanted.items()
            if isinstance(value, tuple) and len(value) != count
        ]
        if magnets is not None:
            wrong = magnets.misfits(self.casing.side)
            problems += [each._replace(key=f"magnets.{each.key}") for each in wrong]
        bore, diagonal = self.feed.bore, self.casing.diagonal
        if bore is not None and bore < diagonal * (1.0 - ROUNDING):
            allowed = f"must be at least the casing's diagonal, {diagonal:.6g}"
            problems.append(Problem("feed.bore", bore, allowed))
        if self.mount == "tube" and not problems:
            problems += self._misfits_of_start()
        problems += self._what_is_in_the_way()
        problems += self._grams()
        if self.solver.method == "paper" and self.mount != "pinned":
            allowed = f"the paper's solver needs mount 'pinned', the mount is {self.mount!r}"
            problems.append(Problem("solver.method", self.solver.method, allowed))
        if not problems:
            problems += self._misfits_of_draws()
        if self.spreads.any:
            problems += self._too_strong_or_fast_draws()
        refuse(problems)
        return self

    @property
    def n(self) -> int:
        """Number of components."""
        return len(self.sequence)

    @property
    def masses(self) -> Array:
        """Masses [kg], shape (n,)."""
        return np.full(self.n, self.casing.mass, dtype=np.float64)

    @property
    def inertias(self) -> Array:
        """Moments of inertia about the centres [kg m²], shape (n,)."""
        if self.casing.inertia is None:
            return square_inertia(self.masses, self.casing.side)
        return np.full(self.n, self.casing.inertia, dtype=np.float64)

    @property
    def frictions(self) -> Array:
        """Friction coefficients, shape (n,)."""
        return np.full(self.n, self.friction, dtype=np.float64)

    @property
    def speeds(self) -> Array:
        """Feed speeds [m/s], component 1 first, shape (n,)."""
        return np.full(self.n, self.feed.speed, dtype=np.float64)

    def _grams(self) -> list[Problem]:
        """Return the problem, if any, with masses that only a wrong unit explains.

        All masses have the same unit, so only the lightest one is checked.
        """
        mass, side = self.casing.mass, self.casing.side
        lightest = min(mass, default=0.0) if isinstance(mass, tuple) else mass
        least, most = (density * side**3 for density in _GRAMS)
        if lightest < _LEAST_GRAMS or not least < lightest < most:
            return []
        allowed = f"must be at most {least:.3g} kg where casing.side is {side:.6g} m"
        told = f"{allowed}; {lightest:.6g} g are {lightest / 1000.0:.6g}"
        return [Problem("casing.mass", mass, told)]

    def _misfits_of_start(self) -> list[Problem]:
        """Return the problems with the initial position of the chain in the tube."""
        key, value = "start_offsets", self.start_offsets
        if value is None and self.start_angles is None:
            return []
        if value is not None and self.start_angles is not None:
            return [Problem(key, value, "must be left out where start_angles are given")]
        casing, along = self.casing, np.ones(self.n)
        offsets = np.array(value)
        if self.start_angles is not None:
            key, value = "start_angles", self.start_angles
            headings = np.cumsum((0.0, *value))
            along, across = narrowest(np.cos(headings), np.sin(headings))
            offsets = casing.diagonal * across
        needed = float(np.abs(offsets).max())
        if needed > self.play + ROUNDING * casing.diagonal:
            allowed = f"must lie within {self.play:.6g} m of the tube's axis, as its bore asks"
            if key == "start_angles":
                allowed = f"hinges {allowed}; their narrowest strip reaches {needed:.6g}"
            return [Problem(key, value, allowed)]
        steepest = np.abs(np.diff(offsets)).max(initial=0.0)
        if steepest > casing.side or (along <= 0.0).any():
            allowed = f"neighbouring hinges must lie at most the side, {casing.side:.6g} m, off"
            return [Problem(key, value, f"{allowed} each other across the tube")]
        return []

    def _what_is_in_the_way(self) -> list[Problem]:
        """Return the problems with obstacles in the tube's bore or where the chain begins."""
        solids = {f"obstacles[{k}]": each for k, each in enumerate(self.obstacles)}
        if self.field is not None and self.field.magnet is not None:
            solids["field.magnet"] = self.field.magnet.outline
        diagonal, problems = self.casing.diagonal, list[Problem]()
        for key, solid in solids.items():
            place = Problem(f"{key}.position", solid.position, "")
            if self.mount == "tube":
                # The bore begins beyond the obstacle, and ends outside the mouth where the tube
                # no longer guides casings.
                end, half = min(float(solid.corners[:, 0].min()), 0.0) - diagonal, 0.5 * self.bore
                room = 1.0 - ROUNDING  # they may touch
                if solid.overlaps(_box(end, -room * half, room * diagonal, room * half)):
                    allowed = (
                        f"must leave free the tube's bore and as much before its mouth as a "
                        f"casing is long: nowhere both x < {diagonal:.6g} and |y| < {half:.6g}"
                    )
                    problems.append(place._replace(allowed=allowed))
            elif self.contact and self.start_angles is None:
                # With given start angles, the fold fails instead.
                for number, square in enumerate(self._straight_chain(), 1):
                    if solid.overlaps(square):
                        allowed = f"component {number} begins there"
                        problems.append(place._replace(allowed=allowed))
        return problems

    def _straight_chain(self) -> Iterator[Array]:
        """Yield the outlines of a straight chain's casings, shrunk to allow them to touch."""
        half = 0.5 * self.casing.diagonal
        square = (1.0 - 1e-6) * half * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
        for k in range(self.n):
            yield square + np.array([(2 * k + 1) * half, 0.0])

    def _misfits_of_draws(self) -> list[Problem]:
        """Return the problem, if any, with the extreme draws of sizes and obstacles' positions."""
        spreads = self.spreads
        ends: list[tuple[str, dict[str, Any]]] = []
        if max(spreads.side, spreads.inset) > 0.0:
            name = "side" if spreads.side > 0.0 else "inset"
            sides = 1.0 - spreads.side, 1.0 + spreads.side
            ends += [(name, self._sized(side, 1.0 + spreads.inset)) for side in sides]
        if spreads.moves_obstacles:
            name = "obstacle_offset" if spreads.obstacle_offset > 0.0 else "obstacle_width"
            units = map(np.array, itertools.product((-1.0, 1.0), repeat=2))
            ends += [(name, {"obstacles": self._obstacles_at(unit)}) for unit in units]
        for name, changes in ends:
            try:
                self.replace(spreads=sections.Spreads(), **changes)
            except SceneError as error:
                allowed = f"a scene at its end: {'; '.join(error.lines)}"
                return [Problem(f"spreads.{name}", getattr(spreads, name), allowed)]
        return []

    def _too_strong_or_fast_draws(self) -> list[Problem]:
        """Return the problems with spreads whose draws exceed the largest remanence or speed."""
        spreads, schedule = self.spreads, self.feed.schedule
        strongest = 0.0
        if self.magnets is not None and self.magnets.remanence is not None:
            strongest = float(np.max(self.magnets.remanence))
            strongest *= (1.0 + spreads.remanence) * (1.0 + spreads.magnet)
        fastest = float(np.max(self.feed.speed)) * (1.0 + spreads.feed_jitter)
        if schedule is not None:
            fastest = max(fastest, float(schedule.speeds.max()))
        fastest *= 1.0 + spreads.feed_speed
        problems: list[Problem] = []
        for key, largest, (most, unit, *_), names in (
            ("magnets.remanence", strongest, base.REMANENCE, ("remanence", "magnet")),
            ("feed.speed", fastest, base.SPEED, ("feed_speed", "feed_jitter")),
        ):
            name = max(names, key=lambda each: getattr(spreads, each))
            if largest > most and getattr(spreads, name) > 0.0:
                allowed = f"must keep {key} at most {most:g} {unit}; draws reach {largest:.6g}"
                problems.append(Problem(f"spreads.{name}", getattr(spreads, name), allowed))
        return problems

    def _obstacles_at(self, unit: Array) -> tuple[Rectangle, ...]:
        """Return the obstacles at the positions drawn with ``unit``, two numbers from [−1, 1)."""
        y = np.array([each.position[1] for each in self.obstacles])
        places = self.spreads.obstacle_places(y, unit[None])[0].tolist()
        return tuple(
            each.model_copy(update={"position": (each.position[0], place)})
            for each, place in zip(self.obstacles, places, strict=True)
        )

    def _sized(self, side: float, inset: float) -> dict[str, Any]:
        """Return changes of the scene that multiply the casings' side and the magnets' inset."""
        changes: dict[str, Any] = {"casing": {"side": self.casing.side * side}}
        if self.magnets is not None:
            changes["magnets"] = {"inset": np.asarray(self.magnets.inset) * inset}
        return changes

    @property
    def charges(self) -> Array:
        """Magnetic charges of the outer pole faces [A m], N positive, shape (n, 4).

        Component 1 is first, and faces are in the order of `FACES`; a face without a magnet has 0.
        The inner pole face of a magnet carries the opposite charge.
        """
        if self.magnets is None:
            return np.zeros((self.n, len(FACES)))
        return signs(self.sequence) * self.magnets.charges(self.n)

    @property
    def bore(self) -> float:
        """Inner width of the tube [m]."""
        return self.feed.bore if self.feed.bore is not None else BORE * self.casing.diagonal

    @property
    def solids(self) -> tuple[Rectangle, ...]:
        """Fixed bodies: the two walls of the tube, a fixed magnet, and obstacles, if any."""
        walls: tuple[Rectangle, ...] = ()
        if self.mount == "tube":
            # The tube is longer than the chain, which cannot reach the inner end.
            length, wall = 2.0 * self.n * self.casing.diagonal, self.feed.wall
            middle = 0.5 * (self.bore + wall)
            walls = tuple(
                Rectangle(position=(-0.5 * length, y), size=(length, wall))
                for y in (middle, -middle)
            )
        magnet = self.field.magnet if self.field is not None else None
        return (*walls, *(() if magnet is None else (magnet.outline,)), *self.obstacles)

    @property
    def play(self) -> float:
        """Largest distance of a hinge from the tube's axis, to either side [m]."""
        return max(0.5 * (self.bore - self.casing.diagonal), 0.0)

    @property
    def start_offset_spread(self) -> float:
        """Half-width of the uniform draw of each hinge's offset at release from a tube [m].

        Joint angles are then at most `start_angle_spread`, and every casing is within the bore.
        """
        return min(self.play, 0.25 * self.start_angle_spread * self.casing.diagonal)

    @property
    def is_concrete(self) -> bool:
        """Whether the scene has nothing left to draw; `draw` then returns the scene itself."""
        offsets = self.start_offsets if self.mount == "tube" else None
        lies = self.start_angles is not None or offsets is not None
        shaken = self.bumps is not None and self.bumps.seed is None
        return lies and not shaken and not self.spreads.any

    def replace(self, **changes: Any) -> Scene:
        """Return a new, validated scene; a mapping, at any depth, changes only the keys in it.

        Parameters
        ----------
        changes
            Fields of the scene or of its groups: ``replace(feed={"speed": 0.1}, friction=0.3)``.

        Raises
        ------
        SceneError
            If the new scene is not valid.
        """
        # These keys are alternatives: setting one removes the other.
        for given, other in (("start_angles", "start_offsets"), ("start_offsets", "start_angles")):
            if given in changes:
                changes.setdefault(other, None)
        named = changes.get("magnets")
        if isinstance(named, Mapping):
            new = dict(cast("Mapping[str, Any]", named))
            for given, other in (("pole_charge", "remanence"), ("remanence", "pole_charge")):
                if new.get(given) is not None:
                    new.setdefault(other, None)
            changes["magnets"] = new
        # Groups without changes are already valid.
        entries: dict[str, Any] = {name: getattr(self, name) for name in Scene.model_fields}
        return Scene(**_merged(entries, changes))

    def pictured(self, angles: Array) -> list[Markup]:
        """Return the chain at headings (n,) [rad] as one SVG; empty if a heading is not finite."""
        if not np.isfinite(angles).all():
            return []
        sizes = None if self.magnets is None else self.magnets.lengths
        return [chain_svg(angles, self.casing.side, self.sequence, sizes)]

    def _shown(self) -> list[Block]:
        always = ("mount", "friction", "casing.side", "casing.mass", "magnets.remanence")
        facts = base.by_key(self.model_dump(), lists=False)
        given = base.by_key(self.model_dump(exclude_defaults=True), lists=False)
        told = {key: facts[key] for key in always if key in facts} | given
        told["sequence"] = " ".join(self.sequence)
        return [*self.pictured(np.zeros(self.n)), facts_table("Scene, SI units", told)]

    def alone(self) -> Scene:
        """Return the scene with the chain pinned, without a tube, obstacles or bumps."""
        return self.replace(mount="pinned", obstacles=(), bumps=None)

    def draw(self, rng: np.random.Generator) -> Scene:
        """Draw all random values and return a concrete scene, in which nothing is left to draw.

        These values are always drawn, in this order, so that a new spread does not change the
        values of the others: friction (1), mass (n), remanence (1), feed speed (1), start angles
        (n-1) or, in a tube, the offsets of hinges (n+1), each uniform over its width. If feed
        jitter or individual magnets vary, both are drawn next: feed jitter (n) and magnets (4n),
        component by component. The last values are drawn only if they vary: width (1) and offset
        (1) of obstacles; side (1) and inset (1); the seed of bumps (1); angle (1) and direction
        (1) of a tilted floor. A concrete scene draws nothing.

        Parameters
        ----------
        rng
            Source of the draws.
        """
        if self.is_concrete:
            return self
        n, spreads = self.n, self.spreads
        tube = self.mount == "tube"
        first = 2 * n + (4 if tube else 2)
        unit = 2.0 * rng.random(first + 5 * n * spreads.one_by_one) - 1.0
        friction, mass, strength, speed = (each[0] for each in spreads.factors(n, unit[None]))
        changes: dict[str, Any] = {
            "friction": np.asarray(self.friction) * friction,
            "spreads": sections.Spreads(),
        }
        if spreads.mass > 0.0:
            casing: dict[str, Any] = {"mass": self.masses * mass}
            if self.casing.inertia is not None:
                casing["inertia"] = self.inertias * mass
            changes["casing"] = casing
        if self.magnets is not None and max(spreads.remanence, spreads.magnet) > 0.0:
            name = self.magnets.strength_name
            changes["magnets"] = {name: np.asarray(getattr(self.magnets, name)) * strength}
        if max(spreads.feed_speed, spreads.feed_jitter) > 0.0:
            changes["feed"] = {"speed": np.asarray(self.feed.speed) * speed}
            if self.feed.schedule is not None:
                pace = 1.0 + spreads.feed_speed * float(unit[n + 2])
                changes["feed"]["schedule"] = self.feed.schedule.scaled(pace)
        for group, values in self._draw_last(rng).items():
            is_group = isinstance(values, Mapping)
            changes[group] = {**changes.get(group, {}), **values} if is_group else values
        start = unit[n + 3 : first]
        if tube and self.start_angles is None and self.start_offsets is None:
            changes["start_offsets"] = self.start_offset_spread * start + 0.0  # no -0.0
        elif self.start_angles is None and not tube:
            changes["start_angles"] = self.start_angle_spread * start + 0.0
        return self.replace(**changes)

    def _draw_last(self, rng: np.random.Generator) -> dict[str, Any]:
        """Draw the last values, each only if it varies, and return the changes of the scene."""
        changes: dict[str, Any] = {}
        spreads = self.spreads
        if spreads.moves_obstacles:
            changes["obstacles"] = self._obstacles_at(2.0 * rng.random(2) - 1.0)
        if max(spreads.side, spreads.inset) > 0.0:
            side, inset = 2.0 * rng.random(2) - 1.0
            changes |= self._sized(1.0 + spreads.side * side, 1.0 + spreads.inset * inset)
        if self.bumps is not None and self.bumps.seed is None:
            changes["bumps"] = {"seed": int(rng.integers(1, 2**31 - 1))}
        if spreads.tilt > 0.0:
            normal, along = spreads.tilted(self.gravity, 2.0 * rng.random(2) - 1.0)
            changes["gravity"] = {"normal": normal, "in_plane": along}
        return changes


def unless_a_scene(value: object, key: str = "scene") -> list[Problem]:
    """Return the problem, if any, with a value that must be a scene."""
    return unless_a(key, value, Scene, "a Scene, as load_scene returns one")


def _box(left: float, low: float, right: float, high: float) -> Array:
    return np.array([(left, low), (right, low), (right, high), (left, high)])


def _merged(old: object, new: Mapping[str, Any]) -> dict[str, Any]:
    """Return a group's entries, updated with those of `new`, also in nested groups."""
    old = old.model_dump() if isinstance(old, base.FrozenModel) else old
    merged = dict(cast("dict[str, Any]", old)) if isinstance(old, dict) else {}
    for key, value in new.items():
        if isinstance(value, Mapping):
            merged[key] = _merged(merged.get(key), cast("Mapping[str, Any]", value))
        else:
            merged[key] = value.model_dump() if isinstance(value, base.FrozenModel) else value
    return merged
