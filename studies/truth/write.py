"""True end points and beams of 400 rays, for studies of accuracy: writes studies/truth/truth.json.

    python -m studies.truth.write

Nothing of the package is used. The rays are those of rays.py, 66 digits along the path and about 40 in the
derivatives; some of them are computed once more by the other method of check.py, and tests/data/rays.json is
computed too. The file holds 25 digits, and says under "about" what they mean and under "checked" what was compared.
"""

import json
import math
import random
import time
from pathlib import Path

from mpmath import mp, mpf

from .camera import Place, metric, photon, unit
from .check import differences, reference_agreement, second_beam
from .rays import DIGITS, beam, displaced, escapes, polar_turns

OUTPUT = Path(__file__).with_name("truth.json")
WRITTEN_DIGITS = 25

NEAR = Place(0.999, 6.03, math.pi / 2, "circular")
# (family, camera, how many rays)
ORDERS = (
    ("whole sky", NEAR, 100),
    ("whole sky", Place(0.999, 2.6, math.pi / 2, "circular"), 34),
    ("whole sky", Place(0.5, 10.0, 1.0, "fiducial"), 33),
    ("whole sky", Place(0.9, 50.0, 0.3, "fiducial"), 33),
    ("near the edge", NEAR, 60),
    ("near the edge", Place(0.9, 8.0, 1.0, "fiducial"), 60),
    ("through the poles", NEAR, 40),
    ("through the poles", Place(0.7, 4.0, 0.8, "fiducial"), 40),
)
# Every how many rays of a camera the second method is asked, too.
CHECKED_OF = 16

ABOUT = {
    "camera": "index into cameras: spin, radius, inclination (1.5707963267948966 is pi/2 exactly), velocity",
    "sky": "N in doubles, to be divided by its length",
    "direction": "n' on the celestial sphere",
    "azimuth": "unwrapped azimuth in radians, 0 at the camera; modulo 2 pi where b = 0",
    "mino_time": "Mino time from the camera to infinity",
    "delay": "limit of |t| - r - 2 ln r backward along the ray, t = 0 at the camera",
    "delta_plus, delta_minus, determinant": "diameters of the beam and det J, signed as in docs/conventions.md",
    "columns": "3 x 2: change of n' in space for displacements of N along e_1, e_2 of kerrcaustics.tangent_basis "
    "(Duff et al. 2017) at N divided by its length: with s = 1 if N_z >= 0 else -1 and c = -1 / (s + N_z), "
    "e_1 = (1 + s c N_x^2, s c N_x N_y, -s N_x), e_2 = (c N_x N_y, s + c N_y^2, -N_y)",
    "index": "Morse index",
    "edge_distance": "radians on the camera sky from N to the shadow edge (near the edge)",
    "axis_distance": "least angle between the ray and the spin axis, in radians: arcsin of the least sin(theta) "
    "(through the poles)",
    "checked": "largest differences before rounding to 25 digits: direction, azimuth and delay absolute, mino_time and "
    "delta_plus relative, columns and delta_minus relative to delta_plus; tests/data/rays.json is rounded to doubles",
}


class Edge:
    """The shadow edge on the sky of a camera outside all spherical photon orbits, as a closed curve N(turn)."""

    def __init__(self, place: Place):
        self.place, self.at, a = place, metric(place), mpf(place.spin)
        horizon = 1 + mp.sqrt(1 - a**2)
        grid = mp.linspace(horizon, mpf(4), 1001)[1:]
        inside = [i for i, r in enumerate(grid) if self._theta_potential(r) > 0]
        ends = (grid[inside[0] - 1 : inside[0] + 1], grid[inside[-1] : inside[-1] + 2])
        low, high = (mp.findroot(self._theta_potential, bracket, solver="anderson") for bracket in ends)
        self.middle, self.half = (low + high) / 2, (high - low) / 2

    def _constants(self, r: mpf) -> tuple[mpf, mpf]:
        """b and q of the spherical photon orbit at r (JTFT A.1)."""
        a = mpf(self.place.spin)
        b = -(r**3 - 3 * r**2 + a**2 * r + a**2) / (a * (r - 1))
        return b, -(r**3) * (r**3 - 6 * r**2 + 9 * r - 4 * a**2) / (a * (r - 1)) ** 2

    def _theta_potential(self, r: mpf) -> mpf:
        b, q = self._constants(r)
        return q - self.at.cos**2 * ((b / self.at.sin) ** 2 - mpf(self.place.spin) ** 2)

    def point(self, turn: mpf) -> list:
        at, r = self.at, self.middle + self.half * mp.cos(turn)
        b, _ = self._constants(r)
        energy = (1 - at.shift * b) / at.lapse
        n_phi = b / (energy * at.varpi)
        n_theta = mp.sqrt(max(self._theta_potential(r), mpf(0)) / at.sigma) / energy * mp.sign(mp.sin(turn))
        n_r = mp.sqrt(1 - n_phi**2 - n_theta**2)
        doppler, shrink = 1 - at.speed * n_phi, -mp.sqrt(1 - at.speed**2)
        return unit([shrink * n_r / doppler, (at.speed - n_phi) / doppler, -shrink * n_theta / doppler])

    def tangent(self, turn: mpf) -> list:
        step = mpf(10) ** (-mp.dps // 3)
        ahead, behind = self.point(turn + step), self.point(turn - step)
        return [(p - m) / (2 * step) for p, m in zip(ahead, behind, strict=True)]

    def distance(self, sky: list, turn: mpf) -> mpf:
        """Angle between N and the edge, from a point of the edge nearby."""
        n = unit(sky)

        def slope(t: mpf) -> mpf:
            return sum((x - y) * d for x, y, d in zip(n, self.point(t), self.tangent(t), strict=True))

        nearest = mp.findroot(slope, (turn, turn + mpf("1e-6")), tol=mpf(10) ** (-1.4 * mp.dps))
        return 2 * mp.asin(mp.norm([x - y for x, y in zip(n, self.point(nearest), strict=True)]) / 2)


def whole_sky(place: Place, count: int, rng: random.Random) -> list[dict]:
    """Escaping directions, uniform on the camera sky."""
    rays = []
    while len(rays) < count:
        sky = [float(x) for x in unit([rng.gauss(0, 1) for _ in range(3)])]
        if escapes(place, sky):
            rays.append({"sky": sky})
    return rays


def near_the_edge(place: Place, count: int, rng: random.Random) -> list[dict]:
    """Directions 1e-1 to 1e-10 outside the shadow edge, at any of its points."""
    edge, rays = Edge(place), []
    while len(rays) < count:
        turn, goal = mpf(rng.uniform(0, 2 * math.pi)), mpf(10) ** rng.uniform(-10, -1)
        x, y, z = edge.point(turn)
        d, e, f = edge.tangent(turn)
        across = unit([y * f - z * e, z * d - x * f, x * e - y * d])
        for side in (goal, -goal):
            sky = [float(p) for p in unit(displaced([x, y, z], across, side))]
            if escapes(place, sky):
                rays.append({"sky": sky, "edge_distance": edge.distance(sky, turn)})
                break
    return rays


def axis_distance(place: Place, sky: list) -> mpf:
    """Least sin(theta) that the constants of the ray allow, as an angle; reached where the ray turns back."""
    path, a = photon(place, unit(sky)), mpf(place.spin)
    c = path.q + path.b**2 + a**2
    # a^2 x^2 - c x + b^2 = 0 for x = sin(theta)^2.
    return mp.asin(mp.sqrt(2 * path.b**2 / (c + mp.sqrt(c**2 - 4 * (a * path.b) ** 2))))


def sky_of_momentum(place: Place, b: mpf, angle: float) -> list[float]:
    """Direction N of a photon of angular momentum b, in any of the directions that have it."""
    at = metric(place)
    n_phi = b * at.lapse / (at.varpi * (1 - at.shift * b))
    along = (at.speed - n_phi) / (1 - at.speed * n_phi)
    across = mp.sqrt(1 - along**2)
    return [float(x) for x in (across * mp.cos(angle), along, across * mp.sin(angle))]


def through_the_poles(place: Place, count: int, rng: random.Random) -> list[dict]:
    """Rays 1e-1 to 1e-14 from the spin axis; where N holds b = 0 exactly, every fifth goes through it."""
    rays = []
    while len(rays) < count:
        goal, angle = mpf(10) ** rng.uniform(-14, -1) * rng.choice((-1, 1)), rng.uniform(0, 2 * math.pi)
        if place.velocity == "fiducial" and len(rays) % 5 == 4:
            goal = mpf(0)
        b = mpf(0)
        for _ in range(4):
            sky = sky_of_momentum(place, b, angle)
            path = photon(place, unit(sky))
            b = goal * mp.sqrt(path.q + path.b**2 + mpf(place.spin) ** 2)
        sky = sky_of_momentum(place, b, angle)
        if escapes(place, sky) and polar_turns(place, sky) > 0:
            rays.append({"sky": sky, "axis_distance": axis_distance(place, sky)})
    return rays


FAMILIES = {"whole sky": whole_sky, "near the edge": near_the_edge, "through the poles": through_the_poles}


def written(value: object) -> object:
    """A number of the file: 25 digits as a string."""
    if isinstance(value, list):
        return [written(v) for v in value]
    return mp.nstr(value, WRITTEN_DIGITS) if isinstance(value, mpf) else value


def checks(rays: list[dict], cameras: list[Place]) -> dict:
    """Largest differences from the second method, and from the same method with more digits."""
    worst: dict[str, dict[str, mpf]] = {"second method": {}, "more digits": {}}
    chosen = [r for r in rays if r["family"] != "through the poles" or r["axis_distance"] > 0][::CHECKED_OF]
    counts = dict.fromkeys(worst, 0)
    for ray in chosen:
        place, sky, distance = cameras[ray["camera"]], ray["sky"], ray.get("edge_distance", mpf(1))
        with mp.workdps(DIGITS):
            others = {"more digits": beam(place, sky, distance, DIGITS + 14)}
            if photon(place, unit(sky)).q > 0:
                others["second method"] = second_beam(place, sky, distance)
        for name, other in others.items():
            counts[name] += 1
            for key, gap in differences(ray, other).items():
                worst[name][key] = max(gap, worst[name].get(key, mpf(0)))
    return {name: {"rays": counts[name], **{k: mp.nstr(v, 1) for k, v in worst[name].items()}} for name in worst}


def main() -> None:
    started = time.process_time()
    rng = random.Random(2015)
    cameras = list(dict.fromkeys(place for _, place, _ in ORDERS))
    rays = []
    for family, place, count in ORDERS:
        with mp.workdps(DIGITS):
            chosen = FAMILIES[family](place, count, rng)
        for ray in chosen:
            found = beam(place, ray["sky"], ray.get("edge_distance", mpf(1)))
            rays.append({"family": family, "camera": cameras.index(place), **ray, **found})
        print(f"{len(rays)} rays after {time.process_time() - started:.0f} s")
    checked = {**checks(rays, cameras), "tests/data/rays.json": reference_agreement()}
    with mp.workdps(DIGITS):
        lines = [json.dumps({k: written(v) for k, v in ray.items()}, separators=(",", ":")) for ray in rays]
    head = {"about": ABOUT, "cameras": [place._asdict() for place in cameras], "checked": checked}
    parts = [f"{json.dumps(key)}:{json.dumps(value)}" for key, value in head.items()]
    text = "{" + ",\n".join(parts) + ',\n"rays":[\n' + ",\n".join(lines) + "\n]}\n"
    OUTPUT.write_text(text, encoding="utf-8")
    print(json.dumps(checked, indent=1))
    print(f"{OUTPUT} written: {len(text) / 1000:.0f} kB, {time.process_time() - started:.0f} s")


if __name__ == "__main__":
    main()
