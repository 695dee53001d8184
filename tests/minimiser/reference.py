"""Magnetic energies from positions alone, slow, and independent of the package."""

from itertools import combinations, product

import numpy as np
from scipy.integrate import quad

MU0 = 4e-7 * np.pi
TURN = {"L": np.pi / 2, "S": 0.0, "R": -np.pi / 2}
SIGNS = {"N": 1.0, "S": -1.0, "-": 0.0}
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


def by_face(magnets, name):
    """A length of each face's magnet [m]."""
    return np.broadcast_to(getattr(magnets, name), 4)


def strengths(magnets, n):
    """Charge of each face's magnet without sign (n, 4) [A·m]."""
    if magnets.pole_charge is not None:
        return np.broadcast_to(magnets.pole_charge, (n, 4))
    area = by_face(magnets, "width") * by_face(magnets, "height")
    return np.broadcast_to(np.asarray(magnets.remanence) * area / MU0, (n, 4))


def nodes_of(centre, heading, faces, side, magnets, strength=None):
    """Node positions (m, 2), charges (m,) and heights (m,) of one component's eight pole faces.

    `strength` (4,) [A·m] where components differ.
    """
    count = magnets.nodes or (3 if magnets.model == "points" else 16)
    if magnets.model == "points":
        offsets, weights = np.linspace(-0.5, 0.5, count), np.full(count, 1 / count)
    else:
        offsets, weights = np.polynomial.legendre.leggauss(count)
        offsets, weights = offsets / 2, weights / 2
    if strength is None:
        strength = strengths(magnets, 1)[0]
    lengths = [by_face(magnets, name) for name in ("width", "thickness", "inset")]
    positions, charges = [], []
    for f, (width, thickness, inset) in enumerate(zip(*lengths, strict=True)):
        angle = heading + FACE_NORMALS[f]
        normal = np.array([np.cos(angle), np.sin(angle)])
        along = np.array([-normal[1], normal[0]])
        sign = SIGNS[faces[f]] * strength[f]
        outer = side / 2 - inset
        for distance, pole in ((outer, sign), (outer - thickness, -sign)):
            positions.append(centre + distance * normal + np.outer(offsets * width, along))
            charges.append(pole * weights)
    heights = np.repeat(by_face(magnets, "height"), 2 * count)
    return np.concatenate(positions), np.concatenate(charges), heights


def potential(rho, magnets, one, other):
    """Energy of unit charges at a distance in the plane, without µ0/4π [1/m].

    They are points, or upright lines of heights `one` and `other` [m].
    """
    if magnets.model == "points":
        return 1 / rho

    def g(u):
        return u * np.arcsinh(u / rho) - np.sqrt(u**2 + rho**2)

    return 2 / (one * other) * (g((one + other) / 2) - g((one - other) / 2))


def interaction(first, second, magnets):
    """Energy [J] of two sets of nodes, equation 6 of the paper or its strip counterpart."""
    (here, q, one), (there, p, other) = first, second
    rho = np.hypot(*(here[:, None] - there[None, :]).transpose(2, 0, 1))
    return MU0 / (4 * np.pi) * q @ potential(rho, magnets, one[:, None], other) @ p


def energy(sequence, word, side, magnets):
    """Energy [J] of a word: each pair of components once, pairs inside a component left out."""
    centres, headings = centres_and_headings(word, side)
    nodes = [
        nodes_of(c, h, faces, side, magnets, strength)
        for c, h, faces, strength in zip(
            centres, headings, sequence, strengths(magnets, len(sequence)), strict=True
        )
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


def own_energy(sequence, magnets):
    """Energy [J] of every pole face alone: every pair of its charges once."""
    mean = np.zeros(4)
    for f in range(4):
        width, height = by_face(magnets, "width")[f], by_face(magnets, "height")[f]
        if magnets.model == "points":
            count = magnets.nodes or 3
            places = np.linspace(-width / 2, width / 2, count)
            mean[f] = sum(1 / abs(x - y) for x, y in combinations(places, 2)) / count**2
        else:
            # Pairs of lines of the face's height, by the distance u between them.
            mean[f], _ = quad(
                lambda u, w, h: (w - u) / w**2 * potential(u, magnets, h, h),
                *(0, width, (width, height)),
            )
    present = np.array([[letter != "-" for letter in faces] for faces in sequence])
    charge = present * strengths(magnets, len(sequence))
    return MU0 / (4 * np.pi) * 2 * np.sum(charge**2 * mean)


def internal_energy(sequence, side, magnets):
    """Energy [J] of the pairs of different pole faces inside each component."""
    total = 0.0
    for faces, strength in zip(sequence, strengths(magnets, len(sequence)), strict=True):
        nodes = nodes_of(np.zeros(2), 0.0, faces, side, magnets, strength)
        poles = list(zip(*(np.split(values, 8) for values in nodes), strict=True))
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
        if sequence[i][mine] == sequence[j][theirs] != "-":
            found.append((i + 1, j + 1))
    return tuple(found)
