"""The rays of rays.py a second time, by elliptic functions and quadrature; and against stored numbers.

Here T, psi and the time are integrals over u = 1/r and the polar angle's part of them Legendre's F and Pi; only the
camera's photon is shared with rays.py. Rays with q <= 0 or b = 0 are left out.
"""

import json
import math
from pathlib import Path

from mpmath import mp, mpf

from .camera import Photon, Place, photon
from .rays import DISPLACEMENT, End, beam, columns_of, ellipse, neighbours, potential

REFERENCE = Path(__file__).parents[2] / "tests" / "data" / "rays.json"
# Half of them go where a ray passes 1e-14 from the axis, and twenty in the differences for J.
DIGITS = 90


def _value(coefficients: list, u: mpf) -> mpf:
    return mp.polyval(coefficients, u, asc=True)


def _divided(coefficients: list, root: mpf) -> list:
    """Coefficients of the polynomial over (root - u)."""
    quotient, carry = [], mpf(0)
    for c in reversed(coefficients[1:]):
        carry = c + carry * root
        quotient.append(-carry)
    return quotient[::-1]


def _rates(a: mpf, b: mpf, q: mpf, u: mpf) -> tuple[mpf, mpf, mpf]:
    """psi', |t|' and (|t| - r - 2 ln r)' in Mino time, without a^2 cos^2(theta); the last on the way outward."""
    d = 1 - 2 * u + (a * u) ** 2
    psi = -a * (2 * u - a * b * u**2) / d
    bounded = (a**2 - a * b + 4 - 2 * a**2 * u + a**3 * (a - b) * u**2) / d + a * (b - a)
    polynomial = potential(a, b, q)
    fall = _value(polynomial[2:], u) * (1 + 2 * u) / (1 + mp.sqrt(_value(polynomial, u)))
    inward = (1 + 2 * u) / u**2 + bounded if u > 0 else mp.inf
    return psi, inward, bounded - fall


def _leg(a: mpf, path: Photon, roots: list, ends: tuple, inward: bool) -> tuple[mpf, mpf, mpf]:
    """Mino time, psi and time or delay between u = ends[0] and the larger ends[1].

    With u = u_1 - (u_2 - u_1) sinh(s)^2 the two square roots at the turning points u_1 < u_2 become smooth.
    """
    full = potential(a, path.b, path.q)
    if roots:
        near, far = roots
        rest, gap = _divided(_divided(full, near), far), far - near
        start, stop = (mp.asinh(mp.sqrt(abs(near - u) / gap)) for u in (ends[1], ends[0]))
    else:
        rest, near, gap, (stop, start) = full, mpf(0), mpf(0), ends

    def rate(s: mpf) -> tuple[mpf, mpf]:
        u = near - gap * mp.sinh(s) ** 2 if roots else s
        return u, (2 if roots else -1) / mp.sqrt(_value(rest, u))

    def integral(part: int | None) -> mpf:
        def integrand(s: mpf) -> mpf:
            u, weight = rate(s)
            return weight if part is None else weight * _rates(a, path.b, path.q, u)[part]

        return mp.quad(integrand, mp.linspace(start, stop, 9), method="gauss-legendre")

    return integral(None), integral(0), integral(1 if inward else 2)


def radial(place: Place, path: Photon) -> tuple[mpf, mpf, mpf]:
    """Mino time, psi and |t| - r - 2 ln r without a^2 cos^2(theta)."""
    a, here = mpf(place.spin), path.position[0]
    horizon = 1 / (1 + mp.sqrt(1 - a**2))
    found = mp.polyroots(potential(a, path.b, path.q), maxsteps=500, extraprec=300, asc=True)
    real = sorted(z.real for z in map(mp.mpc, found) if abs(z.imag) < mpf(10) ** (-mp.dps // 2))
    beyond = [u for u in real if here < u <= horizon * (1 + mpf(10) ** -20)]
    roots = beyond[:2] if len(beyond) >= 2 else []
    if path.rate[0] <= 0:
        out = _leg(a, path, roots, (mpf(0), here), inward=False)
        return out[0], out[1], out[2] - 1 / here + 2 * mp.log(here)
    turn = roots[0]
    down, up = (_leg(a, path, roots, (u, turn), inward=u > 0) for u in (here, mpf(0)))
    return down[0] + up[0], down[1] + up[1], down[2] + up[2] - 1 / turn + 2 * mp.log(turn)


def end(place: Place, sky: list) -> End:
    """The end point of the ray in direction `sky` (unit vector)."""
    path, a = photon(place, sky), mpf(place.spin)
    mino_time, psi, delay = radial(place, path)
    c = a**2 - path.q - path.b**2
    high = (c + mp.sqrt(c**2 + 4 * a**2 * path.q)) / (2 * a**2)
    low = path.q / (a**2 * high)
    scale, parameter = a * mp.sqrt(low), -high / low

    def speed(chi: mpf) -> mpf:
        return a * mp.sqrt(low + high * mp.sin(chi) ** 2)

    # cos(theta) = sqrt(high) sin(chi), and chi grows for ever.
    first = mp.asin(path.position[3] / mp.sqrt(high))
    first = first if path.rate[3] >= 0 else mp.pi - first
    goal = mp.ellipf(first, parameter) + scale * mino_time
    last = first + scale * mino_time / mp.ellipk(parameter) * mp.pi / 2
    for _ in range(100):
        change = (mp.ellipf(last, parameter) - goal) / scale * speed(last)
        last -= change
        if abs(change) < mpf(10) ** (8 - mp.dps):
            break
    turned = path.b / scale * (mp.ellippi(high, last, parameter) - mp.ellippi(high, first, parameter))
    pieces = mp.linspace(first, last, 2 + 4 * int(last - first + 1))
    delay += a**2 * mp.quad(lambda chi: high * mp.sin(chi) ** 2 / speed(chi), pieces, method="gauss-legendre")
    z, azimuth = mp.sqrt(high) * mp.sin(last), psi - turned
    s = mp.sqrt(1 - z**2)
    return End([s * mp.cos(azimuth), s * mp.sin(azimuth), z], azimuth, mino_time, delay)


def second_beam(place: Place, sky: list, distance: mpf) -> dict:
    """The quantities of truth_rays.beam, without the index."""
    with mp.workdps(DIGITS):
        h = DISPLACEMENT * mpf(distance)
        ends = [end(place, n) for n in neighbours(sky, h)]
        columns = columns_of([e.direction for e in ends], h)
        major, minor, determinant = ellipse(ends[0].direction, columns)
        rows = [list(row) for row in zip(*columns, strict=True)]
        sizes = {"delta_plus": major, "delta_minus": minor, "determinant": determinant, "columns": rows}
        return {**ends[0]._asdict(), **sizes}


def differences(one: dict, other: dict) -> dict[str, mpf]:
    """Differences: of n', azimuth and delay in radians and lengths, of the rest relative (J: to delta_plus)."""

    def gap(p: list, q: list) -> mpf:
        return mp.sqrt(sum((x - y) ** 2 for x, y in zip(p, q, strict=True)))

    def flat(rows: list) -> list:
        return [x for row in rows for x in row]

    with mp.workdps(DIGITS):
        major = one["delta_plus"]
        return {
            "direction": gap(one["direction"], other["direction"]),
            "azimuth": abs(one["azimuth"] - other["azimuth"]),
            "mino_time": abs(one["mino_time"] / other["mino_time"] - 1),
            "delay": abs(one["delay"] - other["delay"]),
            "columns": gap(flat(one["columns"]), flat(other["columns"])) / major,
            "delta_plus": abs(one["delta_plus"] / other["delta_plus"] - 1),
            "delta_minus": abs(one["delta_minus"] - other["delta_minus"]) / major,
        }


def reference_agreement() -> dict:
    """Largest differences from tests/data/rays.json, whose numbers are rounded to doubles."""
    worst = {"direction": 0.0, "azimuth": 0.0, "mino_time": 0.0, "delta_plus": 0.0, "delta_minus": 0.0}
    rays = [ray for ray in json.loads(REFERENCE.read_text(encoding="utf-8")) if not ray["captured"]]
    index_differs = 0
    for ray in rays:
        with mp.workdps(100):
            degrees = ray["theta_c_deg"]
            inclination = math.pi / 2 if degrees == 90 else mpf(degrees) * mp.pi / 180
        place = Place(ray["a"], ray["r_c"], inclination, ray["beta"])
        found = beam(place, ray["N"], 1 / mpf(ray["delta_plus"]))
        index_differs += found["index"] != ray["morse"]
        azimuth = found["azimuth"] - ray["phi_unwrapped"]
        if ray["tag"] == "on_axis_b0":
            azimuth -= 2 * mp.pi * mp.nint(azimuth / (2 * mp.pi))
        now = {
            "direction": mp.norm([x - y for x, y in zip(found["direction"], ray["n_inf"], strict=True)]),
            "azimuth": abs(azimuth) / max(1, abs(ray["phi_unwrapped"])),
            "mino_time": abs(found["mino_time"] / ray["mino"] - 1),
            "delta_plus": abs(found["delta_plus"] / ray["delta_plus"] - 1),
            "delta_minus": abs(found["delta_minus"] - ray["delta_minus"]) / ray["delta_plus"],
        }
        worst = {name: max(float(now[name]), worst[name]) for name in worst}
    return {"rays": len(rays), "index_differs": index_differs, **{name: f"{x:.0e}" for name, x in worst.items()}}
