"""The loops of `tests.reference.simulation`, all in one file.

If kernels call functions in another file, numba's cache does not detect edits of that file.
"""

# They spell out what the engine does in many kernels; numbers go in one by one.
# ruff: noqa: PLR0912, PLR0913, PLR0915, PLR0917

import numpy as np
from numba import njit

SLOW = 1e-5  # [m/s] friction is smooth below it
STIFFNESS = 50.0  # of a joint stop [N m/rad]
DAMPING = 0.05  # of a joint stop [N m s/rad]
STRAIGHT = 0.2  # [rad] of the heading of a component that is held again
SHRINK = 5e-4  # squares are this share smaller, so that stops, not corners, hold a folded chain


@njit(cache=True)
def _centres(q, n, lo, d):
    x, y = np.zeros(n), np.zeros(n)
    hx, hy = q[n], q[n + 1]
    for i in range(lo, n):
        x[i], y[i] = hx + d / 2 * np.cos(q[i]), hy + d / 2 * np.sin(q[i])
        hx += d * np.cos(q[i])
        hy += d * np.sin(q[i])
    hx, hy = q[n], q[n + 1]
    for i in range(lo - 1, -1, -1):
        x[i], y[i] = hx - d / 2 * np.cos(q[i]), hy - d / 2 * np.sin(q[i])
        hx -= d * np.cos(q[i])
        hy -= d * np.sin(q[i])
    return x, y


@njit(cache=True, fastmath=True, error_model="numpy")
def _magnet_forces(q, x, y, nodes, charges, height):
    n, m = charges.shape
    force = np.zeros((n, 3))
    px, py = np.zeros((n, m)), np.zeros((n, m))
    for i in range(n):
        c, s = np.cos(q[i]), np.sin(q[i])
        for a in range(m):
            px[i, a] = c * nodes[a, 0] - s * nodes[a, 1]
            py[i, a] = s * nodes[a, 0] + c * nodes[a, 1]
    for i in range(n):
        for j in range(i + 1, n):
            ex, ey = x[i] - x[j], y[i] - y[j]
            for a in range(m):
                fx, fy, tj = 0.0, 0.0, 0.0
                for b in range(m):
                    dx = ex + px[i, a] - px[j, b]
                    dy = ey + py[i, a] - py[j, b]
                    r2 = dx * dx + dy * dy
                    r = np.sqrt(r2)
                    g = charges[j, b] * 2.0 / (r2 * (r + np.sqrt(r2 + height * height)))
                    fx += g * dx
                    fy += g * dy
                    tj -= px[j, b] * (g * dy) - py[j, b] * (g * dx)
                k = 1e-7 * charges[i, a]
                force[i, 0] += k * fx
                force[i, 1] += k * fy
                force[i, 2] += k * (px[i, a] * fy - py[i, a] * fx)
                force[j, 0] -= k * fx
                force[j, 1] -= k * fy
                force[j, 2] += k * tj
    return force


@njit(cache=True)
def _point_row(row, q, n, lo, d, x, y, i, px, py, nx, ny):
    """Add the velocity along (nx, ny) of the point (px, py) of component i to a Jacobian row."""
    row[n] += nx
    row[n + 1] += ny
    for k in range(lo, i):
        row[k] += d * (np.cos(q[k]) * ny - np.sin(q[k]) * nx)
    if i >= lo:
        hx = px - x[i] + d / 2 * np.cos(q[i])
        hy = py - y[i] + d / 2 * np.sin(q[i])
        row[i] += hx * ny - hy * nx


@njit(cache=True)
def _inside(cx, cy, c, s, a, b, px, py):
    """Return the depth of a point in a box and the outward normal of its nearest face."""
    u = c * (px - cx) + s * (py - cy)
    w = -s * (px - cx) + c * (py - cy)
    du, dw = a - abs(u), b - abs(w)
    if du <= 0.0 or dw <= 0.0:
        return 0.0, 0.0, 0.0
    if du < dw:
        e = 1.0 if u > 0 else -1.0
        return du, e * c, e * s
    e = 1.0 if w > 0 else -1.0
    return dw, -e * s, e * c


@njit(cache=True)
def _near(cx, cy, c, s, a, b, px, py, reach):
    """Return the depth of a point near a box, and the direction from the box's nearest point."""
    u = c * (px - cx) + s * (py - cy)
    w = -s * (px - cx) + c * (py - cy)
    du, dw = u - min(max(u, -a), a), w - min(max(w, -b), b)
    away = np.sqrt(du * du + dw * dw)
    if away == 0.0 or away >= reach:
        return 0.0, 0.0, 0.0
    return reach - away, (c * du - s * dw) / away, (s * du + c * dw) / away


@njit(cache=True)
def _rows(q, n, lo, d, side, x, y, solids, shrink, radius, rows, depth, kind):
    """Write the rows of all contacts; return their number.

    Squares are by the share ``shrink`` smaller, and their corners are rounded where they meet
    each other. Free ones meet the rectangles that stand, ``solids`` (k, 6): the centre, the
    direction's cosine and sine, and half the lengths along it and across.
    """
    count = 0
    for k in range(max(lo, 1), n):
        angle = q[k] - q[k - 1]
        over = abs(angle) - np.pi / 2
        if over > 0.0:
            rows[count, :] = 0.0
            e = 1.0 if angle > 0 else -1.0
            rows[count, k] = -e
            if k - 1 >= lo:
                rows[count, k - 1] = e
            depth[count], kind[count] = over, 0
            count += 1
    half = side / 2 * (1.0 - shrink)
    core = half - radius
    for i in range(max(lo - 1, 0), n):
        ci, si = np.cos(q[i] + np.pi / 4), np.sin(q[i] + np.pi / 4)
        for j in range(max(lo - 1, 0), n):
            if abs(i - j) < 2 or (x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2 > d * d:
                continue
            for corner in range(4):  # of j in i
                a = q[j] + corner * np.pi / 2
                px = x[j] + core * np.sqrt(2.0) * np.cos(a)
                py = y[j] + core * np.sqrt(2.0) * np.sin(a)
                if radius > 0.0:
                    over, nx, ny = _near(x[i], y[i], ci, si, core, core, px, py, 2.0 * radius)
                else:
                    over, nx, ny = _inside(x[i], y[i], ci, si, half, half, px, py)
                if over > 0.0 and count < rows.shape[0]:
                    rows[count, :] = 0.0
                    _point_row(rows[count], q, n, lo, d, x, y, j, px, py, nx, ny)
                    _point_row(rows[count], q, n, lo, d, x, y, i, px, py, -nx, -ny)
                    depth[count], kind[count] = over, 1
                    count += 1
        if i < lo:
            continue
        for k in range(len(solids)):
            cx, cy, c, s = solids[k, 0], solids[k, 1], solids[k, 2], solids[k, 3]
            a, b = solids[k, 4], solids[k, 5]
            u, w = c * (x[i] - cx) + s * (y[i] - cy), c * (y[i] - cy) - s * (x[i] - cx)
            if abs(u) > a + d or abs(w) > b + d:
                continue
            for corner in range(4):  # of i in the rectangle, and of the rectangle in i
                turn = q[i] + corner * np.pi / 2
                px = x[i] + half * np.sqrt(2.0) * np.cos(turn)
                py = y[i] + half * np.sqrt(2.0) * np.sin(turn)
                over, nx, ny = _inside(cx, cy, c, s, a, b, px, py)
                if over > 0.0 and count < rows.shape[0]:
                    rows[count, :] = 0.0
                    _point_row(rows[count], q, n, lo, d, x, y, i, px, py, nx, ny)
                    depth[count], kind[count] = over, 1
                    count += 1
                along, across = a if corner % 2 else -a, b if corner > 1 else -b
                px, py = cx + c * along - s * across, cy + s * along + c * across
                over, nx, ny = _inside(x[i], y[i], ci, si, half, half, px, py)
                if over > 0.0 and count < rows.shape[0]:
                    rows[count, :] = 0.0
                    _point_row(rows[count], q, n, lo, d, x, y, i, px, py, -nx, -ny)
                    depth[count], kind[count] = over, 1
                    count += 1
    return count


@njit(cache=True)
def step(
    q, v, lo, last, h, masses, inertias, side, nodes, charges, height, grip, arm, solids,
    slow, rounds, shrink, radius, hard, load, held, place,
):  # fmt: skip
    """Advance q and v by h; returns the largest speed before.

    Coordinates from ``last`` on keep their rates. Friction is linear about the velocities before,
    or, in more ``rounds``, about those of the round before. All springs are so many times as
    ``hard``. A load, forces and torques (n, 3), acts on the components, and a spring keeps
    component ``held`` (−1: none) at a place (x, y, heading).
    """
    stiffness, damping = hard * STIFFNESS, hard * DAMPING
    n = masses.size
    d = side * np.sqrt(2.0)
    rows, depth, kind = np.zeros((64, n + 2)), np.zeros(64), np.zeros(64, dtype=np.int64)
    jx, jy = np.zeros((n, n + 2)), np.zeros((n, n + 2))
    x, y = _centres(q, n, lo, d)
    force = _magnet_forces(q, x, y, nodes, charges, height) + load
    mass, rhs = np.zeros((n + 2, n + 2)), np.zeros(n + 2)
    ax, ay = 0.0, 0.0
    fastest = 0.0
    for i in range(lo, n):
        _point_row(jx[i], q, n, lo, d, x, y, i, x[i], y[i], 1.0, 0.0)
        _point_row(jy[i], q, n, lo, d, x, y, i, x[i], y[i], 0.0, 1.0)
        w2 = v[i] * v[i]
        cx, cy = np.cos(q[i]) * d * w2, np.sin(q[i]) * d * w2
        fx = force[i, 0] - masses[i] * (ax - cx / 2)
        fy = force[i, 1] - masses[i] * (ay - cy / 2)
        ax -= cx
        ay -= cy
        rhs += h * (fx * jx[i] + fy * jy[i])
        rhs[i] += h * force[i, 2]
        mass += masses[i] * (np.outer(jx[i], jx[i]) + np.outer(jy[i], jy[i]))
        mass[i, i] += inertias[i]
    rhs += np.dot(mass, v)
    if held >= 0:
        spin = np.zeros(n + 2)
        spin[held] = d / 2
        away = (place[0] - x[held], place[1] - y[held], d / 2 * (place[2] - q[held]))
        for row, gap in zip((jx[held], jy[held], spin), away):  # noqa: B905 - numba
            k, c = 4 * stiffness / (d * d), 4 * damping / (d * d)
            mass += h * (c + h * k) * np.outer(row, row)
            rhs += h * k * gap * row
    count = _rows(q, n, lo, d, side, x, y, solids, shrink, radius, rows, depth, kind)
    active = np.zeros(count, dtype=np.bool_)
    new = v.copy()
    for turn in range(rounds):
        damp = np.zeros((n + 2, n + 2))
        for i in range(lo, n):
            vx, vy = np.dot(jx[i], new), np.dot(jy[i], new)
            s = np.sqrt(vx * vx + vy * vy + (arm * new[i]) ** 2)
            if turn == 0:
                fastest = max(fastest, s)
            k = grip * masses[i] / np.sqrt(s * s + slow * slow)
            damp += h * k * (np.outer(jx[i], jx[i]) + np.outer(jy[i], jy[i]))
            damp[i, i] += h * k * arm * arm
        if last == lo:
            break
        active[:] = True
        for _ in range(10):
            matrix, right = mass + damp, rhs.copy()
            for r in range(count):
                if active[r]:
                    scale = 1.0 if kind[r] == 0 else 4.0 / (d * d)
                    k, c = stiffness * scale, damping * scale
                    matrix += h * (c + h * k) * np.outer(rows[r], rows[r])
                    right += h * k * depth[r] * rows[r]
            for k in range(last, n + 2):
                right -= matrix[:, k] * v[k]
            new[lo:last] = np.linalg.solve(
                np.ascontiguousarray(matrix[lo:last, lo:last]), right[lo:last]
            )
            dropped = False
            for r in range(count):
                push = stiffness * depth[r]
                push -= (damping + h * stiffness) * np.dot(rows[r], new)
                if active[r] and push < 0.0:
                    active[r] = False
                    dropped = True
            if not dropped:
                break
    v[:] = new
    for k in range(lo, n + 2):
        q[k] += h * v[k]
    return fastest


@njit(cache=True)
def _velocities(q, v, lo, side):
    """Velocities of the centres, (n,) and (n,) [m/s]; what is held goes along with the base."""
    n = q.size - 2
    d = side * np.sqrt(2.0)
    x, y = _centres(q, n, lo, d)
    vx, vy = np.full(n, v[n]), np.full(n, v[n + 1])
    row = np.zeros(n + 2)
    for i in range(lo, n):
        row[:] = 0.0
        _point_row(row, q, n, lo, d, x, y, i, x[i], y[i], 1.0, 0.0)
        vx[i] = np.dot(row, v)
        row[:] = 0.0
        _point_row(row, q, n, lo, d, x, y, i, x[i], y[i], 0.0, 1.0)
        vy[i] = np.dot(row, v)
    return vx, vy


@njit(cache=True)
def _jolt(q, v, lo, masses, inertias, side, vx, vy):
    """Let the free components turn so that their velocities are nearest to those before.

    Those of the centres were ``vx`` and ``vy``, and ``v`` has the rates then and the base's
    velocity now. A difference counts with the mass, that of a rate with the moment of inertia.
    """
    n = q.size - 2
    d = side * np.sqrt(2.0)
    x, y = _centres(q, n, lo, d)
    mass, rhs = np.zeros((n + 2, n + 2)), np.zeros(n + 2)
    for i in range(lo, n):
        jx, jy = np.zeros(n + 2), np.zeros(n + 2)
        _point_row(jx, q, n, lo, d, x, y, i, x[i], y[i], 1.0, 0.0)
        _point_row(jy, q, n, lo, d, x, y, i, x[i], y[i], 0.0, 1.0)
        mass += masses[i] * (np.outer(jx, jx) + np.outer(jy, jy))
        mass[i, i] += inertias[i]
        rhs += masses[i] * ((vx[i] - v[n]) * jx + (vy[i] - v[n + 1]) * jy)
        rhs[i] += inertias[i] * v[i]
    v[:lo] = 0.0
    if lo < n:
        v[lo:n] = np.linalg.solve(np.ascontiguousarray(mass[lo:n, lo:n]), rhs[lo:n])


@njit(cache=True)
def run(
    q, lo, legs, masses, inertias, side, nodes, charges, height, grip, arm, solids, hard, longest,
    after,
):  # fmt: skip
    """Frames' times and headings, how many are held and the largest speed, at the end.

    The feed's ``legs`` (k, 2) are times [s] and speeds [m/s]; else arguments as `simulate` has.
    """
    n = masses.size
    d = side * np.sqrt(2.0)
    v = np.zeros(n + 2)
    none, nowhere = np.zeros((n, 3)), np.zeros(3)
    times, angles = [0.0], [q[:n].copy()]
    t, gone, next_frame, fastest = 0.0, 0.0, 0.0, 0.0
    leg, leg_end, end = -1, 0.0, after if lo == 0 else np.inf
    while t < end:
        if lo > 0 and t >= leg_end - 1e-12 and leg < len(legs):
            leg += 1
            speed = 0.0
            if leg < len(legs):
                speed = legs[leg, 1]
                leg_end += legs[leg, 0]
            else:
                end = t + after
            if speed < 0.0 and gone <= 1e-12:
                speed = 0.0
            vx, vy = _velocities(q, v, lo, side)
            v[n] = speed
            _jolt(q, v, lo, masses, inertias, side, vx, vy)
        # To where something happens to the base: a release, a whole diagonal inside, the stop.
        h = min(longest, end - t)
        inside = 0
        if lo > 0 and leg < len(legs):
            h = min(h, leg_end - t)
        if lo > 0 and v[n] > 0.0:
            h = min(h, (d * np.cos(q[lo - 1]) - q[n]) / v[n])
        if lo > 0 and v[n] < 0.0:
            inside = max(1, int(np.floor((1e-12 - q[n]) / d)) + 1)
            h = min(h, (q[n] + inside * d) / -v[n], gone / -v[n])
        h = max(h, 1e-12)
        # While the tube feeds the base has its own law.
        fastest = step(
            q, v, lo, n if lo > 0 else n + 2, h, masses, inertias, side, nodes, charges, height,
            grip, arm, solids, SLOW, 1, SHRINK, 0.0, hard, none, -1, nowhere,
        )  # fmt: skip
        t += h
        gone += h * v[n]
        if lo > 0 and v[n] > 0.0 and q[n] >= d * np.cos(q[lo - 1]) - 1e-13:
            lo -= 1
            q[n] -= d * np.cos(q[lo])
            q[n + 1] -= d * np.sin(q[lo])
            v[lo] = 0.0
            if lo == 0:
                end = t + after
        if lo > 0 and v[n] < 0.0:
            arrived = q[n] <= -inside * d + 1e-12
            while arrived and lo < n and q[n] <= -d + 1e-12 and abs(q[lo]) <= STRAIGHT:
                vx, vy = _velocities(q, v, lo, side)
                q[n] += d * np.cos(q[lo])
                q[n + 1] += d * np.sin(q[lo])
                lo += 1
                _jolt(q, v, lo, masses, inertias, side, vx, vy)
            if gone <= 1e-12:
                vx, vy = _velocities(q, v, lo, side)
                v[n] = 0.0
                _jolt(q, v, lo, masses, inertias, side, vx, vy)
        if t >= next_frame:
            times.append(t)
            angles.append(q[:n].copy())
            next_frame += 1.0 / 240.0
    times.append(t)
    angles.append(q[:n].copy())
    stacked = np.zeros((len(angles), n))
    for f in range(len(angles)):
        stacked[f] = angles[f]
    return np.array(times), stacked, lo, fastest
