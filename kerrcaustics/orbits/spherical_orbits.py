"""Circular orbits off the equatorial plane: time-like geodesics of constant radius, by two short series.

With chi, the angle along the orbit from its ascending node, cos theta = sin(inclination) sin(chi), and the place is
that on a tilted circle, turned about the spin axis by psi. Per unit of Mino time chi'^2 = c^2 + beta sin(theta)^2 with
beta = a^2 (1 - E^2), L_z = c cos(inclination), Q = (c^2 + beta) sin(inclination)^2: so dt / dchi and dpsi / dchi are
smooth functions of sin(chi)^2, and their integrals are short Fourier series.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.kerr import horizon_product

Array = np.ndarray

# Harmonics of the series, and the places that they are taken from; those left out are the error.
_HARMONICS, _PLACES = 8, 32
_NEWTON = 6
# Newton steps to the constants of the motion.
_POLISHING = 2
_ROUNDING = 4e-15


class OrbitPlace(NamedTuple):
    """Places of bodies: unit vector (n, 3) of theta and phi, its rate (n, 3) in coordinate time, and u^t (n,)."""

    vector: Array
    rate: Array
    clock: Array


def spherical_constants(spin: float, radius: ArrayLike, inclination: ArrayLike) -> tuple[Array, Array, Array]:
    """Energy E, axial angular momentum L_z and Carter constant Q, per rest mass; NaN where no orbit keeps its radius.

    inclination: radians, of the highest latitude, 0 to pi; beyond pi / 2 retrograde.
    """
    energy, swing, _ = _constants(spin, np.asarray(radius, float), np.asarray(inclination, float))
    beta, sine = spin**2 * (1 - energy) * (1 + energy), np.sin(inclination)
    return energy, swing * np.cos(inclination), (swing**2 + beta) * sine**2


def _constants(spin: float, r: Array, inclination: Array) -> tuple[Array, Array, Array]:
    """E and c with L_z = c cos(inclination), which is regular for polar orbits too, and their relative error.

    The radial potential and its slope vanish there: Newton's method in E^2 - 1 and c, from Schmidt's solution.
    """
    r, inclination = np.broadcast_arrays(r, inclination)
    energy, swing = _schmidt(spin, r, inclination)
    excess, off = (energy - 1) * (energy + 1), np.zeros_like(swing)
    with np.errstate(invalid="ignore", divide="ignore"):
        for _ in range(_POLISHING):
            value, slope, size = _potential(spin, 1 / r, inclination, excess, swing)
            determinant = value[1] * slope[2] - value[2] * slope[1]
            excess = excess - (value[0] * slope[2] - value[2] * slope[0]) / determinant
            swing = swing - (value[1] * slope[0] - value[0] * slope[1]) / determinant
            off = size * (np.abs(value[1]) + np.abs(slope[1])) / np.abs(determinant * swing)
    return np.sqrt(1 + excess), swing, np.finfo(float).eps * off


def _potential(spin: float, u: Array, inclination: Array, excess: Array, swing: Array) -> tuple[Array, Array, Array]:
    """The radial potential of `FallConstants` at u = 1 / r, u times its slope there, and the size of its terms.

    Each with its derivatives by E^2 - 1 and by c (3, n). Its terms do not cancel far out.
    """
    tilt, up_2, a_2, energy = np.cos(inclination), np.sin(inclination) ** 2, spin**2, np.sqrt(1 + excess)

    def row(value: Array, by_excess: Any, by_swing: Any) -> Float[Array, "3 ..."]:
        return np.stack(np.broadcast_arrays(value, by_excess, by_swing))

    carter = row((swing**2 - a_2 * excess) * up_2, -a_2 * up_2, 2 * swing * up_2)
    total = row((swing * tilt) ** 2, 0.0, 2 * swing * tilt**2) + carter
    drag = tilt * row(energy * swing, swing / (2 * energy), energy)
    first, second = row(excess, 1.0, 0.0), a_2 * row(excess, 1.0, 0.0) - total
    # (L_z - a E)^2 + Q.
    third = total - 2 * spin * drag + a_2 * row(1 + excess, 1.0, 0.0)
    powers = first, u**2 * second, 2 * u**3 * third, -a_2 * u**4 * carter
    linear = row(2 * u, 0.0, 0.0)
    value, slope = linear + sum(powers), linear + sum(k * term for k, term in zip((0, 2, 3, 4), powers, strict=True))
    return value, slope, 2 * u + sum(np.abs(term[0]) for term in powers)


def _schmidt(spin: float, r: Array, inclination: Array) -> tuple[Array, Array]:
    """E and c of f E^2 - 2 g E c - h c^2 = d and of its derivative by the radius, after Schmidt 2002."""
    a2, z2, w2, sense = spin**2, np.sin(inclination) ** 2, np.cos(inclination) ** 2, np.cos(inclination)
    delta, slope = horizon_product(spin, r), 2 * (r - 1)
    d, d_r = delta * (r * r + z2 * a2), slope * (r * r + z2 * a2) + 2 * r * delta
    f, f_r = r**4 + a2 * (r * (r + 2) + z2 * delta), 4 * r**3 + a2 * (slope + 4 + z2 * slope)
    g, g_r = 2 * spin * r * sense, 2 * spin * sense
    h, h_r = r * (r - 2) * w2 + z2 * delta, slope
    kappa, epsilon, rho = d * h_r - h * d_r, d * g_r - g * d_r, f * h_r - h * f_r
    eta, sigma = f * g_r - g * f_r, g * h_r - h * g_r
    with np.errstate(invalid="ignore", divide="ignore"):
        inner = sigma * (sigma * epsilon**2 + rho * epsilon * kappa - eta * kappa**2)
        root = np.sign(sense) * np.sqrt(np.maximum(inner, 0))
        square = (kappa * rho + 2 * epsilon * sigma - 2 * root) / (rho**2 + 4 * eta * sigma)
        energy = np.sqrt(np.where(square > 0, square, np.nan))
        swing = (f * square - d) / (g * energy + np.sqrt((g * energy) ** 2 + h * (f * square - d)))
    return energy, np.where(swing > 0, swing, np.nan)


@dataclass(frozen=True, eq=False)
class SphericalOrbits:
    """Bodies on circular orbits of any inclination, NaN where there is none.

    radius, inclination, node, phase (n,): radians; at time 0 a body is at the angle phase from its ascending node,
    whose azimuth is node.
    """

    spin: float
    radius: Array
    inclination: Array
    node: Array
    phase: Array

    @cached_property
    def constants(self) -> tuple[Array, Array, Array]:
        """E, L_z and Q (n,)."""
        return spherical_constants(self.spin, self.radius, self.inclination)

    @cached_property
    def error(self) -> Float[Array, " n"]:
        """Errors of places, radians: what the series leave out, that of the constants, and rounding.

        They grow by as much with each radian of the orbit.
        """
        left_out = np.abs(self._spectra[..., _HARMONICS + 1 :]).sum(axis=-1)
        *_, off = _constants(self.spin, self.radius, self.inclination)
        return left_out[0] / self._spectra[0, :, 0] + left_out[1] + np.where(self._flat, 0.0, off) + _ROUNDING

    def errors(self, time: ArrayLike) -> Float[Array, " n"]:
        """Errors of places at coordinate times (n,), radians."""
        return self.error * (1 + np.abs(np.asarray(time, float)) / self._spectra[0, :, 0])

    @property
    def period(self) -> Float[Array, " n"]:
        """Coordinate time (n,) from one ascending node to the next."""
        return 2 * np.pi * self._spectra[0, :, 0]

    @property
    def precession(self) -> Float[Array, " n"]:
        """Angle (n,) by which the node turns in that time, toward larger phi."""
        return 2 * np.pi * self._spectra[1, :, 0]

    def part(self, which: Array) -> "SphericalOrbits":
        """The chosen bodies, in any order and number."""
        some = SphericalOrbits(
            self.spin, *(getattr(self, name)[which] for name in ("radius", "inclination", "node", "phase"))
        )
        some.__dict__["constants"] = tuple(part[which] for part in self.constants)
        some.__dict__["_spectra"] = self._spectra[:, which]
        return some

    def places(self, time: ArrayLike) -> OrbitPlace:
        """Their places at coordinate times (n,)."""
        chi = self._angle(np.asarray(time, float))
        t_rate, turn = self._slopes(chi)
        psi = self.node + self._series(1, chi) - self._series(1, self.phase)
        cosine, sine, tilt, up = np.cos(chi), np.sin(chi), np.cos(self.inclination), self._up
        flat = (cosine + 1j * tilt * sine) * np.exp(1j * psi)
        moved = (-sine + 1j * tilt * cosine) * np.exp(1j * psi) + 1j * turn * flat
        vector = np.stack([flat.real, flat.imag, up * sine], axis=-1)
        rate = np.stack([moved.real, moved.imag, up * cosine], axis=-1) / t_rate[..., None]
        sigma = self.radius**2 + (self.spin * up * sine) ** 2
        return OrbitPlace(vector, rate, t_rate * self._pace(chi) / sigma)

    def _pace(self, chi: Array) -> Array:
        """dchi by Mino time."""
        energy, momentum, carter = (self._column(part, chi) for part in self.constants)
        beta = self.spin**2 * (1 - energy) * (1 + energy)
        up = self._column(self._up, chi)
        # c^2 = Q + L_z^2 - beta sin(inclination)^2.
        square = carter + momentum**2 - beta * up**2
        return np.sqrt(square + beta * (1 - (up * np.sin(chi)) ** 2))

    def _slopes(self, chi: Array) -> tuple[Array, Array]:
        """Derivatives of t and psi by chi."""
        a, r = self.spin, self._column(self.radius, chi)
        energy, momentum, carter = (self._column(part, chi) for part in self.constants)
        beta = a**2 * (1 - energy) * (1 + energy)
        tilt, up, flat = (self._column(part, chi) for part in (np.cos(self.inclination), self._up, self._flat))
        swing, pace = np.sqrt(carter + momentum**2 - beta * up**2), self._pace(chi)
        pull = (energy * (r * r + a * a) - a * momentum) / horizon_product(a, r)
        t_rate = a * (momentum - a * energy * (1 - (up * np.sin(chi)) ** 2)) + (r * r + a * a) * pull
        turn = a * (pull - energy) / pace - tilt * beta / (pace * (swing + pace))
        # Kepler's law holds exactly in the plane.
        return np.where(flat, (tilt + turn) * (tilt * r**1.5 + a), t_rate / pace), turn

    @property
    def _flat(self) -> Bool[Array, " n"]:
        """True in the equatorial plane."""
        return (self.inclination == 0) | (self.inclination == np.pi)

    @property
    def _up(self) -> Float[Array, " n"]:
        """Sine of the inclination; in the plane exactly 0."""
        return np.where(self._flat, 0.0, np.sin(self.inclination))

    @staticmethod
    def _column(values: Array, chi: Array) -> Array:
        return values[:, None] if chi.ndim > 1 else values

    @cached_property
    def _spectra(self) -> Float[Array, "2 n k"]:
        """Fourier coefficients of both slopes: the mean, and those of cos(2 k chi)."""
        chi = np.broadcast_to(np.pi * np.arange(_PLACES) / _PLACES, (len(self.radius), _PLACES))
        spectra = np.fft.rfft(np.stack(self._slopes(chi)), axis=-1).real / _PLACES
        spectra[..., 1:] *= 2
        return spectra

    def _series(self, which: int, chi: Array) -> Array:
        """The integral of a slope from 0 to chi."""
        spectra, wave = self._spectra[which], np.exp(2j * chi)
        total, power = spectra[:, 0] * chi, wave.copy()
        for k in range(1, _HARMONICS + 1):
            total = total + spectra[:, k] * np.imag(power) / (2 * k)
            power = power * wave
        return total

    def _angle(self, time: Array) -> Array:
        """The angle chi at times, by Newton's method."""
        target = time + self._series(0, self.phase)
        chi = target / self._spectra[0, :, 0]
        for _ in range(_NEWTON):
            step = (target - self._series(0, chi)) / self._slopes(chi)[0]
            chi = chi + step
            if not (np.abs(step) > 1e-15 * np.maximum(np.abs(chi), 1)).any():
                break
        return chi
