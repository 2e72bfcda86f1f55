"""Checks of the light of disks: its laws, its profile, its energy."""

import math

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import kerrcaustics as kc
from kerrcaustics.scenes.disk.emission import ThermalEmission, page_thorne_flux
from kerrcaustics.scenes.disk.ring_images import ring_images
from kerrcaustics.spacetime import kerr

from . import screen, twin
from .rays import OTHERS
from .verdict import Check

Array = np.ndarray

SPINS = (-0.9, 0.0, 0.5, 0.998)


def last_orbit(spin: float) -> float:
    """The ISCO; a disk about a negative spin is retrograde."""
    return kerr.isco(abs(spin), spin >= 0)


def iscos() -> Check:
    """Radii of the innermost stable orbit, another program's."""
    reported = OTHERS["disk"]["isco"]
    miss = max(abs(last_orbit(float(spin)) / radius - 1) for spin, radius in reported.items())
    return Check(f"{len(reported)} radii of the ISCO", "Gradus", miss, 1e-12, "of r")


def peaks() -> Check:
    """Radius at which a disk of Page & Thorne is hottest, in radii of the ISCO."""
    miss, across = 0.0, np.linspace(1, 3, 40001)
    for spin, reported in OTHERS["disk"]["temperature_peak_over_isco"].items():
        light = page_thorne_flux(float(spin), last_orbit(float(spin)) * across)
        miss = max(miss, abs(float(across[np.argmax(light)]) - reported))
    # Two decimals are given.
    return Check("radius of the highest temperature, over the ISCO's", "notes; 2 decimals", miss, 0.006, "")


def orbit(spin: float, radius: complex) -> tuple[complex, complex, complex]:
    """Energy and angular momentum of circular geodesics, and their dphi / dt (Bardeen, Press & Teukolsky 1972)."""
    a, r = spin, radius
    root = (1 - 3 / r + 2 * a / r**1.5) ** 0.5
    momentum = r**0.5 * (1 - 2 * a / r**1.5 + a * a / r**2) / root
    return (1 - 2 / r + a / r**1.5) / root, momentum, 1 / (a + r**1.5)


def efficiency(spins: tuple[float, ...] = SPINS) -> Check:
    """The radiation of both faces to infinity is the binding energy of the ISCO (Page & Thorne 1974, section IIIa)."""
    miss = 0.0
    for spin in spins:
        last = last_orbit(spin)

        def lost(s: float, spin: float = spin, last: float = last) -> float:
            r = last / s
            return float(page_thorne_flux(spin, r)) * orbit(spin, r)[0].real * r * last / s**2

        total = quad(lost, 0, 1, epsabs=1e-13, epsrel=1e-11)[0]
        miss = max(miss, abs(total / (1 - orbit(spin, last)[0].real) - 1))
    return Check("energy that a disk radiates", "1 - E of the ISCO", miss, 1e-10, "of it")


def flux(spins: tuple[float, ...] = SPINS) -> Check:
    """The flux in closed form against the conservation laws it solves (Page & Thorne 1974, eq. 12), by quadrature."""
    miss, step = 0.0, 1e-30
    for spin in spins:
        last = last_orbit(spin)

        def torque(r: float, spin: float = spin) -> float:
            energy, momentum, rate = orbit(spin, complex(r, step))
            return (energy - rate * momentum).real * momentum.imag / step

        for r in last * np.array([1.1, 1.5, 3.0, 10.0, 100.0]):
            energy, momentum, rate = orbit(spin, complex(r, step))
            total = quad(torque, last, r, epsabs=1e-14, epsrel=1e-12)[0]
            reported = -rate.imag / step / (energy - rate * momentum).real ** 2 * total / r
            miss = max(miss, abs(float(page_thorne_flux(spin, r)) / reported - 1))
    return Check("flux of a disk of Page & Thorne", "quadrature of their eq. 12", miss, 1e-10, "of it")


def ring(spin: float, inclination: float, inner: float = 6.0, outer: float = 6.06, turns: int = 256) -> Check:
    """The profile of a narrow ring, against the twin's."""
    observer = kc.Observer(spin=spin, inclination=math.radians(inclination))
    found = kc.line_profile(observer, inner, outer, bins=50, turns=2 * turns)
    reported = twin.ring_profile(twin.Screen(spin, math.radians(inclination)), inner, outer, 3.0, found.edges, turns)
    miss = float(np.abs(found.flux - reported).max() / reported.max())
    return Check(f"profile of a ring at r = 6, a = {spin:g}, {inclination:g}°", "quadrature", miss, 3e-4, "of its peak")


def line() -> kc.disks.LineProfile:
    """The line of a disk from the ISCO to 250 whose emissivity falls as the cube of the radius, in another's bins."""
    reported = OTHERS["disk"]["line_profile_edges"]
    observer = kc.Observer(spin=reported["spin"], inclination=math.radians(reported["inclination_deg"]))
    return kc.line_profile(
        observer, last_orbit(reported["spin"]), 250.0, 3.0, bins=np.linspace(0.1, 1.3, 101), turns=256
    )


def line_edges() -> Check:
    """Ends of that line, another program's."""
    reported, found = OTHERS["disk"]["line_profile_edges"], line()
    lit = np.flatnonzero(found.flux > 1e-6 * found.flux.max())
    miss = max(abs(found.edges[lit[0]] - reported["g_from"]), abs(found.edges[lit[-1] + 1] - reported["g_to"]))
    return Check("ends of a line, a = 0.6, 60°", "Gradus; good to 0.05", float(miss), 0.05, "of g")


def transfer(inclination: float, turns: int = 1024) -> tuple[Array, Array, Array, Array]:
    """Cunningham's f of a ring at r = 4, a = 0.998, its g*, dg* / dturn and the angle on the screen, by turn.

    f = g sqrt(g* (1 - g*)) |d(alpha, beta) / d(r, g*)| / (pi r) with g* from 0 to 1 along the ring (Cunningham 1975,
    ApJ 202, 788, eq. 17).
    """
    given, a = OTHERS["disk"]["transfer_function"], OTHERS["disk"]["transfer_function"]["spin"]
    radius, turn = float(given["emission_radius"]), 2 * math.pi * (np.arange(turns) + 0.5) / turns
    camera = screen.observer(a, inclination, 1e6)
    found = ring_images(camera, np.full(turns, radius), turn, 1, "circular")
    g = found.redshift * screen.shift_to_infinity(camera, found.sky)
    smooth = CubicSpline(np.append(turn, turn[0] + 2 * math.pi), np.append(g, g[0]), bc_type="periodic")
    ends = smooth(smooth.derivative().roots(extrapolate=False))
    low, high = float(ends.min()), float(ends.max())
    part, rate = (g - low) / (high - low), smooth.derivative()(turn) / (high - low)
    per_turn = found.solid_angle / radius * camera.radius**2
    f = g * np.sqrt(np.clip(part * (1 - part), 0, 1)) * per_turn / np.abs(rate) / (math.pi * radius)
    b, q = screen.momenta(camera, found.sky)
    alpha = -b / camera.sin_theta
    beta = np.sqrt(np.maximum(q - (alpha**2 - a * a) * camera.cos_theta**2, 0))
    return f, part, rate, np.unwrap(np.arctan2(np.copysign(beta, found.sky[:, 2]), alpha))


def transfer_at(inclination: float, angle: Array, turns: int = 1 << 14) -> tuple[Array, Array]:
    """f and g* of that ring at angles (n,) on the screen."""
    f, part, _, angles = transfer(inclination, turns)
    wrapped = np.unwrap(np.append(angles, angles[0]))
    # Angles grow, or they fall.
    order = slice(None, None, 1 if wrapped[-1] > wrapped[0] else -1)
    values = np.append(np.stack([f, part], axis=1), [[f[0], part[0]]], axis=0)
    at = CubicSpline(wrapped[order], values[order], bc_type="periodic", extrapolate="periodic")(angle)
    return at[:, 0], at[:, 1]


def transfer_points() -> list[Check]:
    """The transfer function itself against another program's, inclination by inclination.

    Both observers stand at r = 1e6: our f differs by 6 / r from that of an observer at infinity, the other by 10 / r.
    """
    rows = np.array(OTHERS["disk"]["transfer_function"]["rows"])
    checks = []
    for inclination in np.unique(rows[:, 0]):
        alpha, beta, part, f = rows[rows[:, 0] == inclination, 1:].T
        ours, our_part = transfer_at(float(inclination), np.arctan2(beta, alpha))
        miss = max(float(np.abs(ours / f - 1).max()), float(np.abs(our_part - part).max()))
        name = f"transfer function at r = 4, a = 0.998, {inclination:g}°, {len(f)} places"
        checks.append(Check(name, "kerrz 0.4.1", miss, 1e-5, "of f"))
    return checks


def transfer_means(inclination: float) -> dict[str, float]:
    """Means of f and of f g*, over the angle on the screen, and over g*."""
    f, part, rate, angle = transfer(inclination)
    weights = {"angle": np.abs(np.gradient(angle)), "g*": np.abs(rate)}
    return {
        f"{name} over {over}": float(np.average(values, weights=weight))
        for name, values in (("f", f), ("f g*", f * part))
        for over, weight in weights.items()
    }


def transfer_checks() -> tuple[Check, list[dict[str, float]]]:
    """Means of the transfer function: against another program's sums; and what we find."""
    given = OTHERS["disk"]["transfer_function_mean"]
    found = [transfer_means(inclination) for inclination in given["inclination_deg"]]
    off = [abs(one["f over angle"] - value) for one, value in zip(found, given["f_over_angle"], strict=True)]
    name = "mean transfer function at r = 4, a = 0.998, 3° to 74°"
    return Check(name, "Gradus, tests of 2022", max(off[:3]), 2e-3, ""), found


class Tolman(ThermalEmission):
    """A disk at rest in thermal equilibrium: its temperature is as much higher as light loses on the way out."""

    def temperature(self, spin: float, radius: Array) -> Array:
        """Kelvin, 5000 far away."""
        return 5000 / np.sqrt(1 - 2 / radius)


def uniform(width: int = 120) -> Check:
    """Matter in equilibrium shines alike from everywhere, through every image: I_nu / nu^3 is kept."""
    camera = kc.Camera(0.9, 30.0, math.radians(80), "static")
    view = kc.pictures.View(width, width // 2, math.radians(60))
    disk = kc.disks.Disk(3.0, 14.0, Tolman(), motion="static")
    rendering = kc.render(camera, view, disk=disk, beaming=True, colour_shift=True)
    whole = rendering.transmission == 0
    # The camera itself sees it as hot as anything at its place.
    sigma = camera.radius**2 + (camera.spin * camera.cos_theta) ** 2
    reported = kc.pictures.black_body(5000 / math.sqrt(1 - 2 * camera.radius / sigma))
    miss = float(np.abs(rendering.light[whole] / reported - 1).max())
    return Check(f"light of matter in equilibrium, {int(whole.sum())} pixels", "a uniform sky", miss, 1e-6, "of it")
