"""A crank-slider of two flexible bars by splines and Radau IIA: shares no code and no discretization with flexcrank.

Bars are geometrically exact Euler-Bernoulli beams that may stretch, without rotary inertia. Their axes r(s) are B-splines of
degree p with p - 1 continuous derivatives. Links share the control point at the pin; the pivot and the slider's guide leave
coordinates out. So there are no constraint equations, and the mass matrix is constant.

With p = r' and w = r'': strain e = |p| - 1, bending measure k = (p x w)/|p|^2, and with Kelvin and Voigt's damping
N = EA (e + c de/dt), M = EJ (k + c dk/dt). The torque works on the tangent at the pivot.
Time: M a = f(q, v, t) is collocated at Radau's points, of order 2 s - 1; Newton has the tangent of the step's beginning.
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from scipy.interpolate import BSpline


class Mechanism(NamedTuple):
    """The mechanism."""

    lengths_m: tuple = (0.5, 1.5)
    area_m2: float = 1e-4
    second_moment_m4: float = 1e-8 / 12
    youngs_modulus_pa: float = 2.1e11
    density: float = 7700.0
    damping_s: float = 1e-4
    slider_kg: float = 0.2
    torque_nm: float = 20.0
    pulse_s: float = 0.1


def radau(stages):
    """Points and matrix of Radau IIA."""
    P = np.polynomial.legendre.Legendre.basis
    c = np.sort((1 + (P(stages) - P(stages - 1)).roots().real) / 2)
    c[-1] = 1.0
    powers = np.arange(stages)
    return c, (c[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(c[:, None] ** powers)


class Chain:
    """The semi-discrete equations in the free coordinates: all x of control points, then all y, less the fixed ones."""

    def __init__(self, bars, spans, degree):
        self.bars = bars
        points = sum(spans) + 2 * degree - 1  # one is shared
        g, gw = np.polynomial.legendre.leggauss(degree + 3)
        rows, at = [], 0
        self.look_at = []
        for length, n in zip(bars.lengths_m, spans):
            knots = np.concatenate([[0.0] * degree, np.linspace(0, length, n + 1), [length] * degree])
            half = length / n / 2
            s = (np.linspace(half, length - half, n)[:, None] + half * g).ravel()
            count = n + degree

            def wide(s, order, knots=knots, count=count, at=at):
                out = np.zeros((len(s), points))
                out[:, at : at + count] = BSpline(knots, np.eye(count), degree)(s, nu=order)
                return out

            rows.append([wide(s, k) for k in range(3)] + [np.tile(half * gw, n)])
            self.look_at.append(wide(np.array([0, length / 2, length]), 0))
            if at == 0:
                self.root = wide(np.zeros(1), 1)[0]
            greville = np.array([knots[i + 1 : i + degree + 1].mean() for i in range(count)])
            start = greville if at == 0 else np.append(start, greville[1:] + bars.lengths_m[0])
            at += count - 1
        n0, self.n1, self.n2, weight = (np.concatenate([r[i] for r in rows]) for i in range(4))
        self.points = points
        self.free = np.array([i for i in range(2 * points) if i not in (0, points, 2 * points - 1)])
        mass = bars.density * bars.area_m2 * (n0.T * weight) @ n0
        mass[-1, -1] += bars.slider_kg
        self.mass = la.block_diag(mass, mass)[np.ix_(self.free, self.free)]
        self.q0 = np.concatenate([start, np.zeros(points)])[self.free]
        self.ea, self.ej = (bars.youngs_modulus_pa * x * weight for x in (bars.area_m2, bars.second_moment_m4))

    def widen(self, q):
        """All control points, from columns of free coordinates: x or y, point, column."""
        full = np.zeros((2 * self.points,) + q.shape[1:])
        full[self.free] = q
        return full.reshape(2, self.points, -1)

    def strains(self, q, v):
        """Gradients of the strains in (p, w), and the resultants; for columns of q and v."""
        x, dx = self.widen(q), self.widen(v)
        p, w, dp, dw = (np.einsum("sn,dnk->dsk", n, y) for n, y in ((self.n1, x), (self.n2, x), (self.n1, dx), (self.n2, dx)))
        length2 = (p * p).sum(0)
        length = np.sqrt(length2)
        unit = p / length
        kappa = (p[0] * w[1] - p[1] * w[0]) / length2
        kp = -(np.stack([-w[1], w[0]]) + 2 * kappa * p) / length2
        kw = np.stack([-p[1], p[0]]) / length2
        c = self.bars.damping_s
        force = self.ea[:, None] * (length - 1 + c * (unit * dp).sum(0))
        moment = self.ej[:, None] * (kappa + c * ((kp * dp).sum(0) + (kw * dw).sum(0)))
        return p, w, dp, dw, length, unit, kappa, kp, kw, force, moment

    def torque(self, t, q):
        """Generalized force of the torque: x and y parts by all coordinates."""
        tau = 0.0
        if t < self.bars.pulse_s * (1 + 1e-12):
            tau = self.bars.torque_nm * (1 - np.cos(2 * np.pi * t / self.bars.pulse_s))
        px, py = np.einsum("n,dn->d", self.root, self.widen(q)[:, :, 0])
        return tau * np.concatenate([-py * self.root, px * self.root]) / (px * px + py * py)

    def forces(self, ts, q, v):
        _, _, _, _, _, unit, _, kp, kw, force, moment = self.strains(q, v)
        f = -np.einsum("sn,dsk->dnk", self.n1, force * unit + moment * kp) - np.einsum("sn,dsk->dnk", self.n2, moment * kw)
        f = f.reshape(2 * self.points, -1)
        for k, t in enumerate(ts):
            f[:, k] += self.torque(t, q[:, k : k + 1])
        return f[self.free]

    def tangents(self, q, v):
        """-df/dq and -df/dv without the torque's."""
        p, w, dp, dw, length, unit, kappa, kp, kw, force, moment = (x[..., 0] for x in self.strains(q[:, None], v[:, None]))
        c = self.bars.damping_s
        eye, turn = np.eye(2)[:, :, None], np.array([[0.0, 1.0], [-1.0, 0.0]])[:, :, None]
        outer = lambda a, b: a[:, None] * b[None]
        hess_e = (eye - outer(unit, unit)) / length
        pp = -2 * (outer(p, kp) + outer(kp, p) + kappa * eye) / length**2
        pw = (turn - 2 * outer(p, kw)) / length**2
        dot = lambda a, b: np.einsum("ijs,js->is", a, b)
        rate_e, rate_p, rate_w = dot(hess_e, dp), dot(pp, dp) + dot(pw, dw), np.einsum("ijs,is->js", pw, dp)
        ea, ej = self.ea, self.ej
        k11 = force * hess_e + ea * outer(unit, unit + c * rate_e) + moment * pp + ej * outer(kp, kp + c * rate_p)
        k12 = moment * pw + ej * outer(kp, kw + c * rate_w)
        k21 = moment * pw.transpose(1, 0, 2) + ej * outer(kw, kp + c * rate_p)
        k22 = ej * outer(kw, kw + c * rate_w)
        d11 = c * (ea * outer(unit, unit) + ej * outer(kp, kp))
        d12, d22 = c * ej * outer(kp, kw), c * ej * outer(kw, kw)
        d21 = d12.transpose(1, 0, 2)
        return self.assemble(k11, k12, k21, k22), self.assemble(d11, d12, d21, d22)

    def assemble(self, b11, b12, b21, b22):
        out = np.empty((2 * self.points, 2 * self.points))
        n = self.points
        for i in range(2):
            for j in range(2):
                out[i * n : i * n + n, j * n : j * n + n] = (
                    self.n1.T @ (b11[i, j][:, None] * self.n1 + b12[i, j][:, None] * self.n2)
                    + self.n2.T @ (b21[i, j][:, None] * self.n1 + b22[i, j][:, None] * self.n2)
                )
        return out[np.ix_(self.free, self.free)]

    def row(self, t, q, v):
        """xB, yB, xC, chord angle, root angle (both within a turn), mid deflections, elongations, energy."""
        x = self.widen(q)[:, :, 0]
        (_, mid1, b), (_, mid2, end) = ((look @ x.T) for look in self.look_at)
        root = x @ self.root
        out = [t, b[0], b[1], end[0], np.arctan2(b[1], b[0]), np.arctan2(root[1], root[0])]
        for start, mid, stop in ((np.zeros(2), mid1, b), (b, mid2, end)):
            along = (stop - start) / np.hypot(*(stop - start))
            out.append(along[0] * (mid - start)[1] - along[1] * (mid - start)[0])
        out += [np.hypot(*b) - self.bars.lengths_m[0], np.hypot(*(end - b)) - self.bars.lengths_m[1]]
        p, w, dp, dw, length, unit, kappa, *_ = self.strains(q[:, None], v[:, None])
        strain = 0.5 * (self.ea[:, None] * (length - 1) ** 2 + self.ej[:, None] * kappa**2).sum()
        return out + [strain + 0.5 * v @ self.mass @ v]


class Radau:
    """Steps of one length for a chain."""

    def __init__(self, chain, step_s, stages):
        self.chain, self.h = chain, step_s
        self.c, self.a = radau(stages)
        self.rates, self.right = np.linalg.eig(self.a)
        self.left = np.linalg.inv(self.right)
        powers = np.arange(stages)
        self.extend = np.linalg.solve((self.c[:, None] ** powers).T, ((1 + self.c)[:, None] ** powers).T)
        self.acc = np.zeros((len(chain.q0), stages))

    def step(self, t, q, v):
        """The state a step later. Newton's guess are the accelerations of the step before, extended."""
        h, c, a = self.h, self.c, self.a
        inverses, last = self.factor(q, v), np.inf
        for _ in range(30):
            qs = q[:, None] + h * v[:, None] * c + h * h * self.acc @ (a @ a).T
            vs = v[:, None] + h * self.acc @ a.T
            z = (self.chain.forces(t + h * c, qs, vs) - self.chain.mass @ self.acc) @ self.left.T
            change = (np.stack([solve(z[:, i]) for i, solve in enumerate(inverses)], axis=1) @ self.right.T).real
            self.acc += change
            size = abs(change).max() * h * h
            if size < 1e-15 or (size < 1e-12 and size > 0.3 * last):
                break
            last = size
        else:
            raise RuntimeError(f"no convergence at {t} s")
        q, v = q + h * v + h * h * self.acc @ (a @ a)[-1], v + h * self.acc @ a[-1]
        self.acc = self.acc @ self.extend
        return q, v

    def factor(self, q, v):
        """What solves Newton's equations, one for each eigenvalue of Radau's matrix."""
        stiffness, damping = self.chain.tangents(q, v)
        matrices = (self.chain.mass + self.h * rate * damping + (self.h * rate) ** 2 * stiffness for rate in self.rates)
        factors = [la.lu_factor(matrix, check_finite=False) for matrix in matrices]
        return [lambda x, f=f: la.lu_solve(f, x, check_finite=False) for f in factors]


def solve(mechanism, spans, degree, step_s, stages, until_s=2.0, every_s=0.01):
    """Rows every `every_s`, for so many spans of crank and rod."""
    chain = Chain(mechanism, spans, degree)
    scheme, q, v = Radau(chain, step_s, stages), chain.q0, 0 * chain.q0
    rows = [chain.row(0.0, q, v)]
    for step in range(round(until_s / step_s)):
        q, v = scheme.step(step * step_s, q, v)
        if (step + 1) % round(every_s / step_s) == 0:
            rows.append(chain.row((step + 1) * step_s, q, v))
    rows = np.array(rows)
    rows[:, 4:6] = np.unwrap(rows[:, 4:6], axis=0)
    return rows
