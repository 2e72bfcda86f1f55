"""Places of bodies in free fall in long arithmetic, by power series; shares no code with the package.

In Mino time r'' and (cos theta)'' are polynomials of r and of cos theta: r'^2 and (cos theta)'^2 are the potentials of
the Kerr metric (Carter 1968). Coordinate time and phi are quadratures of them. The spin axis is singular here.
"""

from typing import NamedTuple

from mpmath import mp, mpf

# Terms of the series for each digit, and digits of the answer beyond those that rounding of the input leaves.
_TERMS, _GUARD = 1.1, 10

Series = list[mpf]


class Release(NamedTuple):
    """A place (r, theta) at phi = 0, and the velocity (v_r, v_theta, v_phi) that the FIDO there measures."""

    spin: float
    radius: float
    theta: float
    velocity: tuple[float, float, float]


class Fall(NamedTuple):
    """r, theta and phi at a coordinate time."""

    radius: mpf
    theta: mpf
    phi: mpf


def true_fall(release: Release, time: float, digits: int = 40) -> Fall | None:
    """The place of a body a time after its release, which may be negative; None if it falls into the hole before."""
    with mp.workdps(digits + _GUARD):
        path = _Path(release, int(digits * _TERMS))
        while True:
            step = path.reach(mpf(10) ** -digits) * (1 if time >= 0 else -1)
            late = path.after(step)
            if abs(late[4]) >= abs(mpf(time)):
                break
            if late[0] < path.horizon * (1 + mpf(10) ** -6) or abs(step) < mpf(10) ** -8:
                return None
            path.move(late)
        r, _, z, _, _, phi = path.after(path.mino_time(mpf(time), step))
        return Fall(r, mp.acos(z), phi)


class _Path:
    """The state (r, r', z, z', t, phi) of a body with z = cos theta, and its series in Mino time."""

    def __init__(self, release: Release, terms: int):
        self.a, r, theta = mpf(release.spin), mpf(release.radius), mpf(release.theta)
        a, (v_r, v_theta, v_phi) = self.a, map(mpf, release.velocity)
        # The double pi / 2 is the equator.
        z, sine = (mpf(0), mpf(1)) if release.theta == float(mp.pi / 2) else (mp.cos(theta), mp.sin(theta))
        sigma, delta = r**2 + (a * z) ** 2, r**2 - 2 * r + a**2
        big = (r**2 + a**2) ** 2 - a**2 * delta * sine**2
        gamma, around = 1 / mp.sqrt(1 - v_r**2 - v_theta**2 - v_phi**2), mp.sqrt(big / sigma) * sine
        self.momentum = gamma * around * v_phi
        self.energy = gamma * mp.sqrt(sigma * delta / big) + 2 * a * r / big * self.momentum
        self.beta = a**2 * (1 - self.energy**2)
        polar = gamma * mp.sqrt(sigma) * v_theta
        self.carter = polar**2 + z**2 * (self.beta + (self.momentum / sine) ** 2)
        self.horizon, self.terms = 1 + mp.sqrt(1 - a**2), terms
        self.state = (r, gamma * mp.sqrt(sigma * delta) * v_r, z, -sine * polar, mpf(0), mpf(0))
        self.expand()

    def expand(self) -> None:
        """The series of r, z, t and phi about the state."""
        a, e, total = self.a, self.energy, self.momentum**2 + self.carter
        kappa = (self.momentum - a * e) ** 2 + self.carter
        # Half of the derivatives of the potentials: of r, ascending; of z, odd.
        force = kappa, a**2 * (e**2 - 1) - total, mpf(3), 2 * (e**2 - 1)
        r, z = [self.state[0], self.state[1]], [self.state[2], self.state[3]]
        r_2: Series = []
        z_2: Series = []
        for k in range(self.terms - 2):
            r_2.append(_product(r, r, k))
            z_2.append(_product(z, z, k))
            pull = force[1] * r[k] + force[2] * r_2[k] + force[3] * _product(r_2, r, k) + (force[0] if k == 0 else 0)
            back = -(total + self.beta) * z[k] + 2 * self.beta * _product(z_2, z, k)
            r.append(pull / ((k + 1) * (k + 2)))
            z.append(back / ((k + 1) * (k + 2)))
        n = len(r_2)
        grown = [part + (a**2 if k == 0 else 0) for k, part in enumerate(r_2)]
        power = [e * part - (a * self.momentum if k == 0 else 0) for k, part in enumerate(grown)]
        ratio = _quotient(power, [part - 2 * r[k] for k, part in enumerate(grown)])
        lifted = _quotient([self.momentum] + [mpf(0)] * (n - 1), [(k == 0) - part for k, part in enumerate(z_2)])
        constant = [a * (self.momentum - a * e)] + [mpf(0)] * (n - 1)
        t_rate = [constant[k] + a**2 * e * z_2[k] + _product(grown, ratio, k) for k in range(n)]
        turn = [lifted[k] + a * ratio[k] - (a * e if k == 0 else 0) for k in range(n)]
        self.series = r, z, _integral(self.state[4], t_rate), _integral(self.state[5], turn)

    def reach(self, tolerance: mpf) -> mpf:
        """A step after which the last terms of all series are that small."""
        rates = []
        for one in self.series:
            size = max(abs(one[0]), mpf(1))
            rates += [(abs(one[-k]) / size / tolerance) ** (mpf(1) / (len(one) - k)) for k in (1, 2) if one[-k]]
        return 1 / max(rates, default=mpf(1))

    def after(self, step: mpf) -> tuple[mpf, ...]:
        """The state after a step."""
        r, z, t, phi = self.series
        slopes = [[k * c for k, c in enumerate(one)][1:] for one in (r, z)]
        return tuple(_sum(one, step) for one in (r, slopes[0], z, slopes[1], t, phi))

    def move(self, state: tuple[mpf, ...]) -> None:
        """Go to a state."""
        self.state = state
        self.expand()

    def mino_time(self, time: mpf, step: mpf) -> mpf:
        """The part of a step after which the coordinate time is reached, by bisection and Newton's method."""
        t = self.series[2]
        slope, low, high = [k * c for k, c in enumerate(t)][1:], mpf(0), step
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if abs(_sum(t, middle)) < abs(time) else (low, middle)
        mino = (low + high) / 2
        for _ in range(8):
            mino -= (_sum(t, mino) - time) / _sum(slope, mino)
        return mino


def _product(one: Series, other: Series, k: int) -> mpf:
    """The coefficient k of a product."""
    return mp.fdot(one[: k + 1], other[k::-1])


def _quotient(one: Series, other: Series) -> Series:
    """A quotient of series."""
    found: Series = []
    for k, part in enumerate(one):
        found.append((part - (_product(found, other[1:], k - 1) if k else 0)) / other[0])
    return found


def _integral(start: mpf, rate: Series) -> Series:
    """The series of an integral."""
    return [start, *(part / (k + 1) for k, part in enumerate(rate))]


def _sum(series: Series, at: mpf) -> mpf:
    """The value of a series."""
    return mp.polyval(series, at, asc=True)
