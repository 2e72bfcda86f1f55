"""Checks of single rays: where they meet the plane, when, with what frequency, how magnified."""

import json
import math
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.scenes.disk.ring_images import ring_images
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import tangent_basis

from ..measured import series
from . import schwarzschild, screen
from .verdict import Check

Array = np.ndarray

OTHERS = json.loads((Path(__file__).parent / "others.json").read_text(encoding="utf-8"))


def landings() -> Check:
    """Places where rays first meet the plane, another program's."""
    miss = 0.0
    for spin, inclination, alpha, beta, x, y in OTHERS["landings"]["rows"]:
        camera = screen.observer(spin, inclination, 1000.0)
        sky = screen.directions(camera, np.array([float(alpha)]), np.array([float(beta)]))
        rays = kc.trace_rays(camera, sky, end=kc.EquatorialPlane(1))
        assert rays.radius is not None
        place = rays.radius[0] * np.exp(1j * rays.azimuth[0])
        miss = max(miss, abs(place - complex(x, y)) / math.hypot(x, y))
    # Coordinates are given to six digits.
    return Check("landing points of 8 rays", "kgeo, ipole; 6 digits", miss, 1e-5, "of r")


def _images() -> tuple[kc.Camera, Array, Array]:
    """The source of other programs' images as a camera, directions of their photons, and their times."""
    reported = OTHERS["images"]
    camera = kc.Camera(
        reported["spin"], reported["source_radius"], math.radians(reported["source_theta_deg"]), "fiducial"
    )
    rows = np.array(reported["rows"]).T
    _, r_sign, theta_sign, b, q, time = rows
    # Their photons leave where ours arrive.
    return camera, screen.arriving(camera, b, q, -r_sign, -theta_sign), time


def times() -> Check:
    """Coordinate times of the images of a source that lies almost in the plane."""
    camera, sky, time = _images()
    rays = kc.trace_rays(camera, sky, end=OTHERS["images"]["observer_radius"], time=True)
    assert rays.time is not None
    return Check("times of 7 images of a source at r = 10", "KerrP2P", np.abs(rays.time - time).max(), 1e-7, "M")


def long_ray() -> Check:
    """A ray that is known to 70 digits: its end and its time."""
    reported, (camera, _, _) = OTHERS["images"]["one_ray_in_70_digits"], _images()
    b, q, r_sign, theta_sign = (np.array([float(reported[k])]) for k in ("lambda", "eta", "nu_r", "nu_theta"))
    sky = screen.arriving(camera, b, q, -r_sign, -theta_sign)
    rays = kc.trace_rays(camera, sky, end=OTHERS["images"]["observer_radius"], time=True)
    assert rays.time is not None
    polar = math.acos(rays.direction[0, 2]) - reported["theta"]
    # Their photon runs the other way round.
    miss = max(abs(polar), abs(rays.azimuth[0] + reported["phi"]), abs(rays.time[0] / reported["time"] - 1))
    return Check("end and time of one ray", "KerrP2P in 70 digits", miss, 1e-12, "rad, of t")


def face_on(radii: tuple[float, ...] = (3.5, 6.0, 10.0, 30.0)) -> Check:
    """At spin 0, from the axis, a ring shines with sqrt(1 - 3 / r) of its frequency."""
    camera = kc.Camera(0.0, 1e6, 0.0, "static")
    radius = np.repeat(radii, 8)
    found = ring_images(camera, radius, np.tile(np.arange(8) * math.pi / 4, len(radii)), 1, "circular")
    g = found.redshift * screen.shift_to_infinity(camera, found.sky)
    return Check("g face-on, a = 0", "sqrt(1 - 3/r)", np.abs(g / np.sqrt(1 - 3 / radius) - 1).max(), 1e-10, "of g")


def edge_on_theory(spin: float, radius: float) -> tuple[float, float]:
    """Least and largest g of a ring seen edge-on: of the photons in the plane that leave it along its radius' tangent.

    There (r^2 + a^2 - a b)^2 = Delta (b - a)^2.
    """
    a, r = spin, radius
    root = math.sqrt(r * r - 2 * r + a * a)
    clock = (1 + a / r**1.5) / math.sqrt(1 - 3 / r + 2 * a / r**1.5)
    b = np.array([(r * r + a * a - a * root) / (a - root), (r * r + a * a + a * root) / (a + root)])
    low, high = 1 / (clock * (1 - b / (a + r**1.5)))
    return float(low), float(high)


def extreme(spin: float, radius: float, below_plane_deg: float, sign: int, zooms: int = 5) -> float:
    """The largest (sign 1) or least (-1) g of a ring's first image, of an observer so far from the plane."""
    camera = screen.observer(spin, 90 - below_plane_deg, 1000.0)
    place, width = 0.0, math.pi
    for _ in range(zooms):
        turn = place + width * np.linspace(-1, 1, 65)
        found = ring_images(camera, np.full(65, radius), turn, 1, "circular")
        g = found.redshift * screen.shift_to_infinity(camera, found.sky)
        place, width = float(turn[np.argmax(sign * g)]), width / 16
    parabola = np.polynomial.Polynomial.fit(turn, g, 4)
    inner = parabola(np.linspace(turn[0], turn[-1], 2001))
    return float(sign * np.max(sign * inner))


def edge_on(cases: tuple[tuple[float, float], ...] = ((0.0, 10.0), (0.9, 6.0))) -> Check:
    """The limit, as the observer comes to the plane, of the extreme g of a ring."""
    above = np.array([8.0, 5.7, 4.0, 2.8, 2.0, 1.4])
    miss = 0.0
    for spin, radius in cases:
        for sign, wanted in zip((-1, 1), edge_on_theory(spin, radius), strict=True):
            found = np.array([extreme(spin, radius, one, sign) for one in above])
            (limit,) = series(np.sin(np.radians(above)), found, np.full(len(above), 1e-10), 1, (0, 2, 4, 6, 8, 10))
            miss = max(miss, abs(limit.value / wanted - 1))
    return Check("extreme g of a ring, edge-on", "photons along its tangent", miss, 1e-6, "of g")


def closed_isoradials(
    cases: tuple[tuple[float, float], ...] = ((6.0, 60.0), (6.0, 80.0), (20.0, 80.0), (3.2, 30.0)), turns: int = 90
) -> tuple[Check, Check]:
    """Isoradials of spin 0 in closed form, at the camera's own distance and at infinity, against where rays land."""
    turn = (np.arange(turns) + 0.5) * 2 * math.pi / turns
    exact, far = 0.0, 0.0
    for radius, inclination in cases:
        camera = kc.Camera(0.0, 1e4, math.radians(inclination), "static")
        for crossing in (1, 2):
            for start in (1 / camera.radius, 0.0):
                b = schwarzschild.isoradial(radius, camera.inclination, turn, crossing, start)
                sky = screen.directions_of_impact(camera, b, turn)
                rays = kc.trace_rays(camera, sky, end=kc.EquatorialPlane(crossing))
                assert rays.radius is not None
                miss = float(np.abs(rays.radius / radius - 1).max())
                exact, far = (max(exact, miss), far) if start else (exact, max(far, miss))
    name = f"isoradials, a = 0: {8 * len(cases) * turns // 4} places, images 1 and 2"
    return (
        Check(name, "Luminet 1979, from r = 1e4", exact, 1e-11, "of r"),
        Check("the same", "Luminet 1979, from infinity", far, 5e-3, "of r"),
    )


def spot(rays: int = 500) -> Check:
    """The light of a small spot of a disk, summed over rays, against that of its images by their magnification."""
    camera, size, spin = kc.Camera(0.9, 40.0, math.radians(75), "static"), 0.02, 0.9
    radius = 8.0
    assert radius > kerr.isco(spin)
    summed, reported = 0.0, 0.0
    for crossing in (1, 2):
        sky = _spot_image(camera, radius, 0.7, crossing)
        one, other = _light_of_rays(camera, sky, crossing, size, rays)
        summed, reported = summed + one, reported + other
    return Check("light of a spot, images 1 and 2", "g^4 over det J", abs(summed / reported - 1), 1e-3, "of the light")


def _spot_image(camera: kc.Camera, radius: float, azimuth: float, crossing: int) -> Array:
    """The direction N (3,) in which a place of the plane is seen."""
    end = kc.EquatorialPlane(crossing)
    turn = np.arange(720) * math.pi / 360
    sky = ring_images(camera, np.full(720, radius), turn, crossing, "circular").sky
    away = np.angle(np.exp(1j * (kc.trace_rays(camera, sky, end=end).azimuth - azimuth)))
    n = sky[np.argmin(np.abs(away))]
    for _ in range(8):
        beam = kc.trace_beams(camera, n[None], end=end, index=False, crossings=False, redshift=False)
        assert beam.radius is not None
        lacking = np.angle(np.exp(1j * (azimuth - beam.azimuth[0])))
        step = np.linalg.solve(beam.jacobian[0], [radius - beam.radius[0], beam.radius[0] * lacking])
        n = n + step @ np.array(tangent_basis(n))
        n = n / np.linalg.norm(n)
    return n


def _light_of_rays(camera: kc.Camera, sky: Array, crossing: int, size: float, count: int) -> tuple[float, float]:
    """Light of a spot about the landing of N, summed over rays in a rectangle about it, and by its magnification."""
    end = kc.EquatorialPlane(crossing)
    beam = kc.trace_beams(camera, sky[None], end=end, index=False, crossings=False)
    assert beam.radius is not None and beam.redshift is not None
    _, stretch, axes = np.linalg.svd(beam.jacobian[0])
    half = 1.2 * size / stretch
    step = (np.arange(count) + 0.5) / count * 2 - 1
    places = np.stack(np.meshgrid(*step[None] * half[:, None]), axis=-1).reshape(-1, 2) @ axes
    rays = kc.trace_rays(camera, sky + places @ np.array(tangent_basis(sky)), end=end, redshift=True)
    assert rays.radius is not None and rays.redshift is not None
    r, phi = rays.radius, rays.azimuth - beam.azimuth[0]
    within = (r - beam.radius[0]) ** 2 + r * beam.radius[0] * phi**2 < size**2
    summed = float((rays.redshift[within] ** 4).sum()) * 4 * half.prod() / count**2
    return summed, float(beam.redshift[0] ** 4 * math.pi * size**2 * beam.magnification[0])
