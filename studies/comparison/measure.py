"""This package, kerrz and Gyoto side by side, in one run on one core: where rays first meet the equatorial plane.

    .venv/bin/python -m studies.comparison.measure

An observer at r = 1000, 60° from the axis of a hole with a = 0.42 (the set-up of kgeo's tests), sees a square of
places. kerrz is a package of PyPI (`pip install "kerrz[py]"`), Gyoto one of Debian (`apt install gyoto-bin`); where one
is absent, it is skipped with its reason. Times are medians of five, of one for Gyoto; compilation is not counted.
Differences are those from this package, in units of M.
"""

import math
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

# Before NumPy and JAX start threads: all that follows, other programs too, runs on one core.
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import numpy as np

import kerrcaustics as kc

from ..disk_checks import screen

Array = np.ndarray

SPIN, INCLINATION, RADIUS = 0.42, 60.0, 1000.0
HALF_WIDTH, SIDE = 12.0, 64

SCENERY = """<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<Scenery>
<Metric kind="KerrBL"><Spin>{spin}</Spin></Metric>
<Screen><Position>0. {radius} {theta} 0.</Position><FieldOfView>{field}</FieldOfView>
<Resolution>{side}</Resolution></Screen>
<Astrobj kind="ThinDisk"><InnerRadius>2.5</InnerRadius><OuterRadius>100.</OuterRadius><RMax>200</RMax></Astrobj>
<Quantities>ImpactCoords</Quantities>
</Scenery>
"""


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """A result, and the median of the seconds that five runs take."""
    result, seconds = None, []
    for _ in range(5):
        began = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - began)
    return result, float(np.median(seconds))


def ours(sky: Array, engine: str = "auto") -> tuple[Array, Array, float]:
    """Radii and azimuths (n,) where rays first meet the plane, and seconds; compilation is not counted."""
    camera, end = screen.observer(SPIN, INCLINATION, RADIUS), kc.EquatorialPlane(1)
    kc.trace_rays(camera, sky, end=end, engine=engine)
    rays, seconds = timed(lambda: kc.trace_rays(camera, sky, end=end, engine=engine))
    assert rays.radius is not None
    return rays.radius, rays.azimuth, seconds


def miss(radius: Array, azimuth: Array, theirs: Array, turned: Array) -> str:
    """Median and largest distance of places that both found, and how many those are."""
    away = np.abs(radius * np.exp(1j * azimuth) - theirs * np.exp(1j * turned))
    both = np.isfinite(away) & (radius < 100) & (radius > 2.5)
    return f"{np.median(away[both]):.1e} M in the median, {away[both].max():.1e} M at most, of {both.sum()} rays"


def kerrz(places: tuple[Array, Array], radius: float = RADIUS) -> tuple[Array, Array, float]:
    """The same by kerrz, a call for each ray; radius: of its observer."""
    import kerrz_python as other

    metric, start = other.KerrMetric(1.0, SPIN), other.FourVector(r=radius, theta=math.radians(INCLINATION))

    def end_of(alpha: float, beta: float) -> tuple[float, float]:
        end = other.NullGeodesic.from_impact_parameters(metric, alpha, beta, start).trace_to_angle(math.pi / 2)
        return end.r, end.phi

    pairs = list(zip(*(axis.tolist() for axis in places), strict=True))
    found, seconds = timed(lambda: np.array([end_of(*pair) for pair in pairs]))
    return *found.T, seconds


def gyoto() -> tuple[Array, float]:
    """Coordinates (n, 8) of rays and their rates where they meet a disk, and seconds of the whole command."""
    from astropy.io import fits

    field = 2 * HALF_WIDTH / RADIUS
    text = SCENERY.format(spin=SPIN, radius=RADIUS, theta=math.radians(INCLINATION), field=field, side=SIDE)
    with tempfile.TemporaryDirectory() as folder:
        scene, output = Path(folder, "scene.xml"), Path(folder, "out.fits")
        scene.write_text(text, encoding="utf-8")
        began = time.perf_counter()
        subprocess.run(["gyoto", "--quiet", "-T1", str(scene), str(output)], check=True, capture_output=True)
        seconds = time.perf_counter() - began
        return np.array(fits.getdata(output, 1), float).reshape(-1, 16)[:, 8:], seconds


def constants_of(ends: Array, spin: float) -> tuple[Array, Array]:
    """b and q (n,) of rays by coordinates and rates (n, 8) at their ends."""
    r, theta, a = ends[:, 1], ends[:, 2], spin
    sigma, sine2 = r**2 + (a * np.cos(theta)) ** 2, np.sin(theta) ** 2
    dt, _, dtheta, dphi = ends[:, 4:].T
    energy = (1 - 2 * r / sigma) * dt + 2 * a * r * sine2 / sigma * dphi
    momentum = sine2 * ((r**2 + a * a + 2 * a * a * r * sine2 / sigma) * dphi - 2 * a * r / sigma * dt)
    b = momentum / energy
    return b, (sigma * dtheta / energy) ** 2 + np.cos(theta) ** 2 * (b**2 / sine2 - a * a)


def sky_of(ends: Array, theta_sign: Array) -> Array:
    """Directions N (n, 3) of rays by coordinates and rates (n, 8) at their ends, and signs of p_theta at the camera."""
    b, q = constants_of(ends, SPIN)
    return screen.arriving(screen.observer(SPIN, INCLINATION, RADIUS), b, q, np.ones_like(b), theta_sign)


def say(name: str, seconds: float, count: int, difference: str) -> None:
    """A line of the measurements."""
    print(f"{name}: {count} rays in {seconds:.3f} s, {seconds / count * 1e6:.1f} us each; {difference}", flush=True)


def measure_kerrz() -> None:
    """This package and kerrz at the same places."""
    line = (np.arange(SIDE) + 0.5) / SIDE * 2 * HALF_WIDTH - HALF_WIDTH
    alpha, beta = np.meshgrid(line, line)
    places = alpha.ravel(), beta.ravel()
    sky = screen.directions(screen.observer(SPIN, INCLINATION, RADIUS), *places)
    radius, azimuth, seconds = ours(sky)
    say("kerrcaustics", seconds, len(sky), "-")
    slow = ours(sky, "integrated")
    say("kerrcaustics, integrated", slow[2], len(sky), miss(radius, azimuth, *slow[:2]))
    try:
        *found, seconds = kerrz(places)
    except ImportError as error:
        print(f"kerrz: skipped, {error}")
        return
    say("kerrz", seconds, len(sky), miss(radius, azimuth, *found))


def measure_gyoto() -> None:
    """This package along the rays that Gyoto traced."""
    if shutil.which("gyoto") is None:
        print("Gyoto: skipped, there is no command gyoto")
        return
    ends, seconds = gyoto()
    # The first half of its rows lies below the middle of the screen.
    theta_sign = np.repeat([-1.0, 1.0], len(ends) // 2)
    met = np.all(np.isfinite(ends), axis=1) & (np.abs(ends[:, 1]) < RADIUS)
    radius, azimuth, _ = ours(sky_of(ends[met], theta_sign[met]))
    say("Gyoto, the command", seconds, len(ends), miss(radius, azimuth, ends[met, 1], ends[met, 3]))


def measure_sky() -> None:
    """Rays and beams over the whole sky of a camera, in seconds of the core: others may work on it at the same time."""
    camera = kc.Camera(spin=0.999, radius=6.03)
    sky = np.random.default_rng(1).normal(size=(1_000_000, 3))
    for name, trace in (("rays", kc.trace_rays), ("beams", kc.trace_beams)):
        for engine in ("auto", "integrated"):
            trace(camera, sky[:1000], engine=engine)
            began = time.process_time()
            for _ in range(3):
                trace(camera, sky, engine=engine)
            each = (time.process_time() - began) / 3
            print(
                f"{name} to infinity, engine {engine}: {each:.2f} us each, {1 / each:.1f} million a second", flush=True
            )


if __name__ == "__main__":
    measure_kerrz()
    measure_gyoto()
    measure_sky()
