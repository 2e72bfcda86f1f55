"""Observers beside kerrz and Gyoto: where rays meet the equatorial plane, and the light of a disk of Page & Thorne.

    .venv/bin/python -m studies.comparison.observers

Other programs put their observers at a radius, and name photons by (alpha, beta), which stand for b and q. The same
photons are seen here by an `Observer` at that radius; one at infinity is the limit. How kerrz and Gyoto can be had:
`measure.py`. Gyoto's disk gives bolometric intensities in units of its own: one factor is fitted, their median.
"""

import math
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.images.reciprocal import directions
from kerrcaustics.scenes.disk.emission import page_thorne_flux

from ..disk_checks import screen
from .measure import HALF_WIDTH, INCLINATION, SPIN, constants_of, kerrz

Array = np.ndarray

SIDE = 24
RADII = (1e3, 1e4, 1e5, 1e6)
DISK_SPIN, DISK_INCLINATION, DISK_RADIUS, DISK_REACH = 0.9, 70.0, 1000.0, 20.0

SCENERY = """<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<Scenery>
<Metric kind="KerrBL"><Spin>{spin}</Spin></Metric>
<Screen><Position>0. {radius} {theta} 0.</Position><FieldOfView>{field}</FieldOfView>
<Resolution>{side}</Resolution></Screen>
<Astrobj kind="PageThorneDisk"><InnerRadius>2.4</InnerRadius><OuterRadius>40.</OuterRadius><RMax>60</RMax></Astrobj>
<Quantities>User4 ImpactCoords</Quantities>
</Scenery>
"""


class Light(NamedTuple):
    """Light of a disk by pixels of Gyoto: constants of the photons, signs of p_theta, intensity, radius."""

    b: Array
    q: Array
    theta_sign: Array
    intensity: Array
    radius: Array


def observer_at(spin: float, inclination_deg: float, radius: float = math.inf) -> kc.Observer:
    """An observer."""
    return kc.Observer(spin=spin, inclination=math.radians(inclination_deg), radius=radius)


def sky_of(observer: kc.Observer, b: Array, q: Array, theta_sign: Array) -> Array:
    """Directions (n, 3) on the sky of the engines of photons with constants b and q, and signs of p_theta."""
    up, down = (directions(observer, b, q, sign) for sign in (1.0, -1.0))
    return np.where((theta_sign > 0)[:, None], up, down)


def landings(observer: kc.Observer, places: tuple[Array, Array]) -> tuple[Array, Array]:
    """Radii and azimuths (n,) where photons of (alpha, beta) first meet the plane."""
    b, q = screen.constants(observer, *places)
    sky = sky_of(observer, b, q, np.where(places[1] < 0, -1.0, 1.0))
    rays = kc.trace_rays(observer, sky, end=kc.EquatorialPlane(1))
    assert rays.radius is not None
    return rays.radius, rays.azimuth


def away(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Distances of places that both found, within the radii of a disk."""
    gap = np.abs(one[0] * np.exp(1j * one[1]) - other[0] * np.exp(1j * other[1]))
    return gap[np.isfinite(gap) & (one[0] < 100) & (one[0] > 2.5)]


def compare_kerrz() -> None:
    """Observers at several radii, and the one at infinity."""
    line = (np.arange(SIDE) + 0.5) / SIDE * 2 * HALF_WIDTH - HALF_WIDTH
    alpha, beta = np.meshgrid(line, line)
    places = alpha.ravel(), beta.ravel()
    limit = landings(observer_at(SPIN, INCLINATION), places)
    for radius in RADII:
        try:
            theirs = kerrz(places, radius)[:2]
        except ImportError as error:
            print(f"kerrz: skipped, {error}")
            return
        same = away(landings(observer_at(SPIN, INCLINATION, radius), places), theirs)
        far = away(limit, theirs)
        print(
            f"kerrz at r = {radius:g}, {len(same)} rays: from an observer there {np.median(same):.1e} M in the median, "
            f"{same.max():.1e} M at most; from one at infinity {np.median(far) * radius:.1f} M / r"
        )


def gyoto_disk(side: int = 48) -> Light:
    """The disk as Gyoto renders it."""
    from astropy.io import fits

    theta, field = math.radians(DISK_INCLINATION), 2 * DISK_REACH / DISK_RADIUS
    text = SCENERY.format(spin=DISK_SPIN, radius=DISK_RADIUS, theta=theta, field=field, side=side)
    with tempfile.TemporaryDirectory() as folder:
        scene, output = Path(folder, "scene.xml"), Path(folder, "out.fits")
        scene.write_text(text, encoding="utf-8")
        subprocess.run(["gyoto", "--quiet", "-T1", str(scene), str(output)], check=True, capture_output=True)
        intensity = np.array(fits.getdata(output, 0), float).ravel()
        ends = np.array(fits.getdata(output, 1), float).reshape(-1, 16)[:, 8:]
    met = np.all(np.isfinite(ends), axis=1) & (np.abs(ends[:, 1]) < DISK_RADIUS) & (intensity > 0)
    # The first half of its rows lies below the middle of the screen.
    theta_sign = np.repeat([-1.0, 1.0], side * side // 2)
    return Light(*constants_of(ends[met], DISK_SPIN), theta_sign[met], intensity[met], ends[met, 1])


def light_of_disk(observer: kc.Observer, sky: Array) -> tuple[Array, Array]:
    """Radii (n,) where rays first meet the plane, and bolometric intensities of a disk of Page & Thorne there."""
    beams = kc.trace_beams(observer, sky, end=kc.EquatorialPlane(1))
    assert beams.radius is not None and beams.redshift is not None
    return beams.radius, beams.redshift**4 * page_thorne_flux(DISK_SPIN, beams.radius)


def compare_disk() -> None:
    """Intensities along the rays that Gyoto traced, seen from its observer's radius."""
    if shutil.which("gyoto") is None:
        print("Gyoto: skipped, there is no command gyoto")
        return
    light = gyoto_disk()
    observer = observer_at(DISK_SPIN, DISK_INCLINATION, DISK_RADIUS)
    radius, own = light_of_disk(observer, sky_of(observer, light.b, light.q, light.theta_sign))
    # The same crossing of the plane; next to the ISCO the light begins from nothing.
    smooth = (np.abs(radius / light.radius - 1) < 1e-3) & (radius > 2.5) & (radius < 39)
    ratio = light.intensity[smooth] / own[smooth]
    miss = np.abs(ratio / np.median(ratio) - 1)
    print(
        f"Gyoto's disk, {smooth.sum()} of {len(smooth)} rays: bolometric intensities {np.median(miss):.1e} in the "
        f"median, {miss.max():.1e} at most"
    )


if __name__ == "__main__":
    compare_kerrz()
    compare_disk()
