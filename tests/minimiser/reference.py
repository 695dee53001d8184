"""Slow magnetic energies from positions, by the sums over charges of `engine.reference`."""

from itertools import combinations, product

import numpy as np
from scipy.integrate import quad

from magfold_bench.laws.exact_magnets import COULOMB, FACES
from tests.engine.reference import pair_energy, pole_nodes, upright_energy

TURN = {"L": np.pi / 2, "S": 0.0, "R": -np.pi / 2}
FACE_NORMALS = np.radians([45.0, 135.0, -135.0, -45.0])


def centres_and_headings(word, side):
    """Return centres (n, 2) [m] and headings (n,) of the chain that a word describes."""
    headings = np.concatenate([[0.0], np.cumsum([TURN[letter] for letter in word])])
    steps = side * np.sqrt(2) * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    hinges = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return (hinges[:-1] + hinges[1:]) / 2, headings


def overlaps(word, side):
    """Return whether two centres are closer than 3 mm (for the paper's casing of 12.5 mm)."""
    centres, _ = centres_and_headings(word, side)
    gaps = [np.hypot(*(a - b)) for a, b in combinations(centres, 2)]
    return min(gaps, default=np.inf) < 0.24 * side


def words(n):
    """Return all words of n components that do not overlap, in the order S, L, R."""
    return [w for w in map("".join, product("SLR", repeat=n - 1)) if not overlaps(w, 1.0)]


def count_of(scene):
    """Return the number of nodes of a pole face."""
    return scene.magnets.nodes or (3 if scene.magnets.model == "points" else 16)


def nodes_of(scene, word):
    """Return positions, charges and heights of the nodes of each component."""
    places = centres_and_headings(word, scene.casing.side)
    return list(zip(*pole_nodes(*places, scene, count_of(scene)), strict=True))


def pole_faces(component):
    """Return the nodes of each of a component's eight pole faces, beginning with the outer ones."""
    return list(zip(*(np.split(values, FACES) for values in component), strict=True))


def energy(scene, word):
    """Return the energy [J] of a word, with each pair of different components counted once."""
    return sum(pair_energy(a, b, scene) for a, b in combinations(nodes_of(scene, word), 2))


def own_energy(scene):
    """Return the energies [J] of single pole faces, with each pair of charges counted once."""
    mean = np.zeros(4)
    for f in range(4):
        width, height = (scene.magnets.by_face(name)[f] for name in ("width", "height"))
        if scene.magnets.model == "points":
            places = np.linspace(-width / 2, width / 2, count_of(scene))
            mean[f] = sum(1 / abs(x - y) for x, y in combinations(places, 2)) / places.size**2
        else:
            # Pairs of lines of the face's height, by the distance u between them.
            mean[f], _ = quad(
                lambda u, w, h: (w - u) / w**2 * upright_energy(u, h, h),
                *(0, width, (width, height)),
            )
    return COULOMB * 2 * np.sum(scene.charges**2 * mean)


def internal_energy(scene):
    """Return the energies [J] of pairs of different pole faces inside each component."""
    inside = [combinations(pole_faces(each), 2) for each in nodes_of(scene, "S" * (scene.n - 1))]
    return sum(pair_energy(a, b, scene) for pairs in inside for a, b in pairs)


def conflicts(sequence, word, side):
    """Return pairs (i, j), from 1, whose casings touch along a face with equal poles."""
    centres, headings = centres_and_headings(word, side)
    found = []
    for i, j in combinations(range(len(sequence)), 2):
        gap = centres[j] - centres[i]
        if not np.isclose(np.hypot(*gap), side):
            continue
        bearing = np.arctan2(gap[1], gap[0])
        mine = np.argmax(np.cos(headings[i] + FACE_NORMALS - bearing))
        theirs = np.argmin(np.cos(headings[j] + FACE_NORMALS - bearing))
        if sequence[i][mine] == sequence[j][theirs] != "-":
            found.append((i + 1, j + 1))
    return tuple(found)
