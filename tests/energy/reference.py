"""Magnetic energies from positions alone, slow, and independent of the package."""

from itertools import combinations, product

import numpy as np
from scipy.integrate import quad

MU0 = 4e-7 * np.pi
TURN = {"L": np.pi / 2, "S": 0.0, "R": -np.pi / 2}
FACE_NORMALS = np.radians([45.0, 135.0, -135.0, -45.0])


def centres_and_headings(word, side):
    """Centres (n, 2) [m] and headings (n,) of the chain that a word describes."""
    headings = np.concatenate([[0.0], np.cumsum([TURN[letter] for letter in word])])
    steps = side * np.sqrt(2) * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    hinges = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return (hinges[:-1] + hinges[1:]) / 2, headings


def overlaps(word, side):
    """Whether two centres lie closer than 3 mm (for the paper's casing of 12.5 mm)."""
    centres, _ = centres_and_headings(word, side)
    gaps = [np.hypot(*(a - b)) for a, b in combinations(centres, 2)]
    return min(gaps, default=np.inf) < 0.24 * side


def words(n):
    """Every word of n components that does not overlap, in the order S, L, R."""
    return [w for w in map("".join, product("SLR", repeat=n - 1)) if not overlaps(w, 1.0)]


def nodes_of(centre, heading, faces, side, magnets):
    """Node positions (m, 2) and charges (m,) of one component's eight pole faces."""
    count = magnets.nodes or (3 if magnets.model == "points" else 16)
    if magnets.model == "points":
        offsets, weights = np.linspace(-0.5, 0.5, count), np.full(count, 1 / count)
    else:
        offsets, weights = np.polynomial.legendre.leggauss(count)
        offsets, weights = offsets / 2, weights / 2
    charge = magnets.charge
    positions, charges = [], []
    for letter, angle in zip(faces, heading + FACE_NORMALS, strict=True):
        normal = np.array([np.cos(angle), np.sin(angle)])
        along = np.array([-normal[1], normal[0]])
        sign = 1.0 if letter == "N" else -1.0
        outer = side / 2 - magnets.inset
        for distance, pole in ((outer, sign), (outer - magnets.thickness, -sign)):
            positions.append(centre + distance * normal + np.outer(offsets * magnets.width, along))
            charges.append(pole * charge * weights)
    return np.concatenate(positions), np.concatenate(charges)


def potential(rho, magnets):
    """Energy of unit charges at a distance in the plane, without µ0/4π [1/m]."""
    if magnets.model == "points":
        return 1 / rho
    height = magnets.height
    slope = np.sqrt(rho**2 + height**2)
    return 2 / height**2 * (height * np.arcsinh(height / rho) - slope + rho)


def interaction(first, second, magnets):
    """Energy [J] of two sets of nodes, equation 6 of the paper or its strip counterpart."""
    (here, q), (there, p) = first, second
    rho = np.hypot(*(here[:, None] - there[None, :]).transpose(2, 0, 1))
    return MU0 / (4 * np.pi) * q @ potential(rho, magnets) @ p


def energy(sequence, word, side, magnets):
    """Energy [J] of a word: each pair of components once, pairs inside a component left out."""
    centres, headings = centres_and_headings(word, side)
    nodes = [
        nodes_of(c, h, faces, side, magnets)
        for c, h, faces in zip(centres, headings, sequence, strict=True)
    ]
    return sum(interaction(a, b, magnets) for a, b in combinations(nodes, 2))


def forms(words, side, magnets):
    """Couplings of all faces (words, 4n, 4n) [J], upper triangles: a word's energy is sᵀ J s."""
    n = len(words[0]) + 1
    found = np.zeros((len(words), n, 4, n, 4))
    for w, word in enumerate(words):
        placed = zip(*centres_and_headings(word, side), strict=True)
        nodes = [nodes_of(c, h, "NNNN", side, magnets) for c, h in placed]
        faces = [list(zip(*(np.split(part, 4) for part in each), strict=True)) for each in nodes]
        for i, j in combinations(range(n), 2):
            for a, b in product(range(4), repeat=2):
                found[w, i, a, j, b] = interaction(faces[i][a], faces[j][b], magnets)
    return found.reshape(len(words), 4 * n, 4 * n)


def own_energy(magnets):
    """Energy [J] of one pole face alone: every pair of its charges once."""
    width = magnets.width
    if magnets.model == "points":
        count = magnets.nodes or 3
        places = np.linspace(-width / 2, width / 2, count)
        mean = sum(1 / abs(x - y) for x, y in combinations(places, 2)) / count**2
    else:
        # Pairs of lines of height H, by the distance u between them.
        mean, _ = quad(lambda u: (width - u) / width**2 * potential(u, magnets), 0, width)
    return MU0 / (4 * np.pi) * magnets.charge**2 * mean


def internal_energy(sequence, side, magnets):
    """Energy [J] of the pairs of different pole faces inside each component."""
    total = 0.0
    for faces in sequence:
        positions, charges = nodes_of(np.zeros(2), 0.0, faces, side, magnets)
        poles = list(zip(np.split(positions, 8), np.split(charges, 8), strict=True))
        total += sum(interaction(a, b, magnets) for a, b in combinations(poles, 2))
    return total


def conflicts(sequence, word, side):
    """Pairs (i, j), 1-based, whose casings touch along a face with equal poles."""
    centres, headings = centres_and_headings(word, side)
    found = []
    for i, j in combinations(range(len(sequence)), 2):
        gap = centres[j] - centres[i]
        if not np.isclose(np.hypot(*gap), side):
            continue
        bearing = np.arctan2(gap[1], gap[0])
        mine = np.argmax(np.cos(headings[i] + FACE_NORMALS - bearing))
        theirs = np.argmin(np.cos(headings[j] + FACE_NORMALS - bearing))
        if sequence[i][mine] == sequence[j][theirs]:
            found.append((i + 1, j + 1))
    return tuple(found)
