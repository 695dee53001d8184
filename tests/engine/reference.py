"""Slow, simple counterparts of the engine in plain NumPy, independent of its code.

Equation 39, exact magnets and overlaps are those of `magfold_bench.laws`.
"""

from itertools import combinations

import numpy as np

from magfold_bench.laws import exact_magnets as exact
from magfold_bench.laws import overlap
from magfold_bench.laws.overlap import Boxes

# --- the chain ------------------------------------------------------------------------------


def centres(q, side):
    """Centres (n, 2) of a chain with coordinates `q` (n + 2,): headings, then the inner hinge."""
    steps = side * np.sqrt(2) * np.stack([np.cos(q[:-2]), np.sin(q[:-2])], axis=1)
    return q[-2:] + np.cumsum(steps, axis=0) - steps / 2


def velocity_map(q, side):
    """Jacobians of the centres, shape (n, 2, n + 2)."""
    n = q.size - 2
    normals = side * np.sqrt(2) * np.stack([-np.sin(q[:n]), np.cos(q[:n])])
    jacobian = np.zeros((n, 2, n + 2))
    for i in range(n):
        jacobian[i, :, :i] = normals[:, :i]
        jacobian[i, :, i] = normals[:, i] / 2
        jacobian[i, :, n:] = np.eye(2)
    return jacobian


def mass_matrix(q, side, masses, inertias):
    """Mass matrix (n + 2, n + 2) of a free chain."""
    jacobian = velocity_map(q, side)
    matrix = np.einsum("i,idk,idl->kl", masses, jacobian, jacobian)
    return matrix + np.diag(np.append(inertias, [0.0, 0.0]))


def velocity_accelerations(q, v, side):
    """Accelerations (n, 2) of the centres when no coordinate accelerates."""
    n = q.size - 2
    steps = side * np.sqrt(2) * np.stack([np.cos(q[:n]), np.sin(q[:n])], axis=1)
    turned = -steps * np.square(v[:n])[:, None]
    return np.cumsum(turned, axis=0) - turned / 2


# --- magnets --------------------------------------------------------------------------------


def pole_nodes(places, headings, scene, count):
    """Positions (n, 8·count, 2), charges and heights (n, 8·count) of casings' pole faces."""
    faces = exact.faces_of(scene, places, headings)
    if scene.magnets.model == "points":
        # One charge sits in the middle.
        offsets = np.linspace(-0.5, 0.5, count) if count > 1 else np.zeros(1)
        shares = np.full(count, 1 / count)
    else:
        offsets, shares = np.polynomial.legendre.leggauss(count)
        offsets, shares = offsets / 2, shares / 2
    width, height = faces.size.T
    nodes = (
        faces.centre[:, None] + np.multiply.outer(width, offsets)[..., None] * faces.along[:, None]
    )
    charge, n = np.multiply.outer(faces.charge, shares), len(headings)
    return nodes.reshape(n, -1, 2), charge.reshape(n, -1), np.repeat(height, count).reshape(n, -1)


def magnet_forces(places, headings, scene, count):
    """Forces (n, 2), torques (n,) about the centres and energy of casings anywhere."""
    nodes = list(zip(*pole_nodes(places, headings, scene, count), strict=True))
    force, torque, energy = np.zeros((scene.n, 2)), np.zeros(scene.n), 0.0
    for i, j in combinations(range(scene.n), 2):
        energy += pair_energy(nodes[i], nodes[j], scene)
        for a, b in ((i, j), (j, i)):
            pull = pair_force(nodes[a], nodes[b], scene)
            arm = nodes[a][0] - places[a]
            force[a] += pull.sum(axis=0)
            torque[a] += (arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]).sum()
    return force, torque, energy


def pair_force(here, there, scene):
    """Forces (k, 2) [N] on the nodes `here` by all nodes `there`: like charges repel."""
    (x, q, one), (y, p, other) = here, there
    d = x[:, None] - y[None, :]
    rho = np.hypot(d[..., 0], d[..., 1])
    if scene.magnets.model == "points":
        law = 1 / rho**3
    else:
        # Minus the slope of `upright_energy` over ρ, without cancellation.
        far, near = (np.hypot(rho, (one[:, None] + sign * other) / 2) for sign in (1, -1))
        law = 2 / (rho**2 * (near + far))
    return exact.COULOMB * q[:, None] * np.einsum("kl,kld->kd", law * p, d)


def pair_energy(here, there, scene):
    """Energy [J] of the nodes `here` with the nodes `there`, every pair once."""
    (x, q, one), (y, p, other) = here, there
    rho = np.hypot(*(x[:, None] - y[None, :]).transpose(2, 0, 1))
    law = 1 / rho if scene.magnets.model == "points" else upright_energy(rho, one[:, None], other)
    return exact.COULOMB * q @ law @ p


def upright_energy(rho, one, other):
    """Mean of 1/r between upright lines of heights `one` and `other`, both centred on the plane."""

    def g(u):
        return u * np.arcsinh(u / rho) - np.hypot(u, rho)

    return 2 / (one * other) * (g((one + other) / 2) - g((one - other) / 2))


# --- squares --------------------------------------------------------------------------------


def square(centre, heading, half):
    """A casing, whose diagonal lies along the heading."""
    return rectangle(centre, heading + overlap.TO_FACE, half, half)


def rectangle(centre, turn, half_x, half_y):
    """A box turned by an angle."""
    return Boxes(*(np.array([each]) for each in (centre, turn, (half_x, half_y))))


def separation(first, second):
    """Largest separation of two boxes over their edge normals; negative: overlap."""
    return float(overlap.separation(first, second, 0.0)[0])


def distance(first, second):
    """Distance of two boxes; where they overlap, minus the way out."""
    return float(overlap.separation(first, second)[0])


# --- derivatives ----------------------------------------------------------------------------


def derivative(function, step):
    """First derivative at 0 by sixth-order central differences."""
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    return sum(w * (function(k * step) - function(-k * step)) for k, w in weights.items()) / step


def second_derivative(function, step):
    """Second derivative at 0 by sixth-order central differences."""
    weights = {1: 3 / 2, 2: -3 / 20, 3: 1 / 90}
    total = -49 / 18 * function(0.0)
    for k, w in weights.items():
        total = total + w * (function(k * step) + function(-k * step))
    return total / step**2
