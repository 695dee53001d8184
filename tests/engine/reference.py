"""Slow and obvious counterparts of the engine, in plain NumPy and independent of its code."""

from itertools import combinations

import numpy as np

# As the ampere was defined until 2019; that of CODATA 2022 is 1.3e-10 less.
MU0 = 4e-7 * np.pi  # [N/A²]
COULOMB = MU0 / (4.0 * np.pi)
FACE_NORMALS = np.radians([45.0, 135.0, -135.0, -45.0])


# --- the chain ------------------------------------------------------------------------------


def equation_39(scene, angles, rates, force, torque):
    """Angular accelerations (n,) of the pinned chain by the paper's eq. 39, symbol by symbol.

    `force` (n, 2) [N] and `torque` (n,) [N·m] act at the centres; in-plane gravity comes on top.
    """
    n = scene.n
    half = scene.casing.side / np.sqrt(2)
    spokes = half * np.exp(1j * np.asarray(angles))  # r_l and r_c: the centre lies halfway
    matrix_a = np.eye(n) - np.eye(n, k=-1)
    matrix_b = np.eye(n) - np.eye(n, k=1)
    matrix_r = np.diag(spokes) + np.diag(spokes[:-1], k=-1)
    real, imag = np.real(matrix_r), np.imag(matrix_r)
    inverse_b = np.linalg.inv(matrix_b)
    matrix_e = inverse_b @ np.diag(scene.masses) @ np.linalg.inv(matrix_a)
    pull = force + scene.masses[:, None] * np.asarray(scene.gravity.in_plane)
    left = np.diag(scene.inertias) + real.T @ matrix_e @ real + imag.T @ matrix_e @ imag
    right = (
        torque
        + (real.T @ matrix_e @ imag - imag.T @ matrix_e @ real) @ np.square(rates)
        + real.T @ inverse_b @ pull[:, 1]
        - imag.T @ inverse_b @ pull[:, 0]
    )
    return np.linalg.solve(left, right)


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


SIGNS = {"N": 1.0, "S": -1.0, "-": 0.0}


def pole_nodes(centre, heading, faces, scene, count, strengths=None):
    """Positions (8·count, 2) and charges (8·count,) of one component's pole faces.

    `strengths` (4,) [A·m] are the faces' charges without sign, where they are not all equal.
    """
    magnets = scene.magnets
    if magnets.model == "points":
        offsets, shares = np.linspace(-0.5, 0.5, count), np.full(count, 1 / count)
    else:
        offsets, shares = np.polynomial.legendre.leggauss(count)
        offsets, shares = offsets / 2, shares / 2
    if strengths is None:
        strengths = np.full(4, magnets.charge)
    widths, insets, thicknesses = four(scene, "width", "inset", "thickness")
    places, charges = [], []
    for f, letter in enumerate(faces):
        angle = heading + FACE_NORMALS[f]
        normal = np.array([np.cos(angle), np.sin(angle)])
        along = np.array([-normal[1], normal[0]])
        pole = SIGNS[letter] * strengths[f]
        outer = scene.casing.side / 2 - insets[f]
        for depth, charge in ((outer, pole), (outer - thicknesses[f], -pole)):
            places.append(centre + depth * normal + np.outer(offsets * widths[f], along))
            charges.append(charge * shares)
    return np.concatenate(places), np.concatenate(charges)


def four(scene, *names):
    """Lengths of a casing's magnets [m], face by face: (4,) a name."""
    return [np.broadcast_to(getattr(scene.magnets, name), 4) for name in names]


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
    return MU0 / (4 * np.pi) * q[:, None] * np.einsum("kl,kld->kd", law * p, d)


def pair_energy(here, there, scene):
    """Energy [J] of the nodes `here` with the nodes `there`, every pair once."""
    (x, q, one), (y, p, other) = here, there
    rho = np.hypot(*(x[:, None] - y[None, :]).transpose(2, 0, 1))
    law = 1 / rho if scene.magnets.model == "points" else upright_energy(rho, one[:, None], other)
    return MU0 / (4 * np.pi) * q @ law @ p


def upright_energy(rho, one, other):
    """Mean of 1/r between upright lines of heights `one` and `other`, both centred on the plane."""

    def g(u):
        return u * np.arcsinh(u / rho) - np.hypot(u, rho)

    return 2 / (one * other) * (g((one + other) / 2) - g((one - other) / 2))


def magnet_forces(places, headings, scene, count):
    """Forces (n, 2), torques (n,) about the centres and energy of casings anywhere."""
    heights = np.repeat(four(scene, "height")[0], 2 * count)
    strengths = scene.magnets.charges(scene.n)
    nodes = [
        (*pole_nodes(place, heading, faces, scene, count, strength), heights)
        for place, heading, faces, strength in zip(
            places, headings, scene.sequence, strengths, strict=True
        )
    ]
    force, torque, energy = np.zeros((scene.n, 2)), np.zeros(scene.n), 0.0
    for i, j in combinations(range(scene.n), 2):
        energy += pair_energy(nodes[i], nodes[j], scene)
        for a, b in ((i, j), (j, i)):
            pull = pair_force(nodes[a], nodes[b], scene)
            arm = nodes[a][0] - places[a]
            force[a] += pull.sum(axis=0)
            torque[a] += (arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]).sum()
    return force, torque, energy


def rectangle_field(points, width, height):
    """Closed-form ∫ r/|r|³ dA (k, 3) of the rectangle |x| ≤ width/2, |z| ≤ height/2 at y = 0."""
    x, y, z = points.T
    field = np.zeros_like(points)
    for sx in (-1.0, 1.0):
        for sz in (-1.0, 1.0):
            u, w = x - sx * width / 2, z - sz * height / 2
            r = np.sqrt(u**2 + y**2 + w**2)
            sign = sx * sz
            field[:, 0] -= sign * np.arcsinh(w / np.hypot(u, y))
            field[:, 2] -= sign * np.arcsinh(u / np.hypot(w, y))
            field[:, 1] += sign * np.arctan(u * w / (y * r))
    return field


def rectangle_force(offset, turn, width, height, count=40):
    """In-plane force (2,) and torque about its own centre on a rectangle of unit charge.

    It is centred at `offset` (2,) from another one, whose width lies along x, and turned by
    `turn`; both stand on the plane. The other's field is closed; over this one it is summed with
    `count`² Gauss-Legendre nodes. Without µ0/4π [1/m², 1/m].
    """
    nodes, weights = np.polynomial.legendre.leggauss(count)
    s, z = np.meshgrid(nodes * width / 2, nodes * height / 2, indexing="ij")
    share = np.outer(weights, weights).ravel() / 4
    along = np.array([np.cos(turn), np.sin(turn)])
    plane = offset + np.outer(s.ravel(), along)
    points = np.column_stack([plane, z.ravel()])
    pull = rectangle_field(points, width, height)[:, :2] / (width * height) * share[:, None]
    arm = plane - offset
    return pull.sum(axis=0), (arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]).sum()


def akoun_yonnet(offset, width, height):
    """In-plane force (2,) between parallel rectangles of unit charge, without µ0/4π [1/m²].

    Akoun and Yonnet's closed form; `offset` is along the width and across the faces.
    """
    total = np.zeros(2)
    w = offset[1]
    for i, j, k, m in np.ndindex(2, 2, 2, 2):
        sign = (-1) ** (i + j + k + m)
        u = offset[0] + ((-1) ** j - (-1) ** i) * width / 2
        v = ((-1) ** m - (-1) ** k) * height / 2
        r = np.sqrt(u**2 + v**2 + w**2)
        angle = np.arctan(u * v / (r * w))
        total[0] += sign * (
            (v**2 - w**2) / 2 * np.log(r - u) + u * v * np.log(r - v) + v * w * angle + r * u / 2
        )
        total[1] += sign * (-u * w * np.log(r - u) - v * w * np.log(r - v) + u * v * angle - r * w)
    return total / (width * height) ** 2


def flush_force(scene):
    """Force [N] between two opposite pole faces of casings that lie flush: the hardest of four."""
    strengths = scene.magnets.charges(scene.n).max(axis=0)
    faces = zip(*four(scene, "inset", "width", "height"), strengths, strict=True)
    return max(
        MU0 / (4 * np.pi) * q**2 * abs(akoun_yonnet(np.array([0.0, 2 * inset]), *size)[1])
        for inset, *size, q in faces
    )


# --- squares --------------------------------------------------------------------------------


def square(centre, heading, half):
    """Corners (4, 2), counter-clockwise, of a casing whose diagonal lies along the heading."""
    angles = heading + np.radians([0.0, 90.0, 180.0, 270.0])
    return centre + half * np.sqrt(2) * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def rectangle(centre, half_x, half_y):
    """Corners (4, 2), counter-clockwise, of a box along the axes."""
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    return centre + signs * [half_x, half_y]


def separation(first, second):
    """Largest separation of two convex polygons over their edge normals; negative: overlap."""
    best = -np.inf
    for one, other in ((first, second), (second, first)):
        edges = np.roll(one, -1, axis=0) - one
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
        normals = normals / np.hypot(*normals.T)[:, None]
        gaps = np.einsum("ed,ecd->ec", normals, other[None, :] - one[:, None]).min(axis=1)
        best = max(best, gaps.max())
    return best


def distance_to_segment(point, start, end):
    """Distance of a point from a segment."""
    edge = end - start
    share = np.clip((point - start) @ edge / (edge @ edge), 0.0, 1.0)
    return np.hypot(*(point - start - share * edge))


def polygon_distance(first, second):
    """Distance of two convex polygons that do not overlap."""
    return min(
        distance_to_segment(point, start, end)
        for one, other in ((first, second), (second, first))
        for point in other
        for start, end in zip(one, np.roll(one, -1, axis=0), strict=True)
    )


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
