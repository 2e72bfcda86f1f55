"""Observers beside kerrz and Gyoto: where rays meet the equatorial plane, and the light of a disk of Page & Thorne.

    .venv/bin/python -m studies.comparison.observers

Other programs put their observers at a radius, and name photons by (alpha, beta), which stand for b and q. The same
photons are seen here by an `Observer` at that radius. For the one at infinity theirs are extrapolated, linearly in 1/r
from their last two radii. How kerrz and Gyoto can be had: `measure.py`. Gyoto's disk gives bolometric intensities in
units of its own: one factor is fitted, their median.
"""

import math
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.trace import beams_of_directions, rays_of_directions
from kerrcaustics.images.reciprocal import directions
from kerrcaustics.scenes.disk.emission import page_thorne_flux

from ..disk_checks import screen
from .measure import HALF_WIDTH, INCLINATION, SPIN, constants_of, kerrz

Array = np.ndarray

SIDE = 24
RADII = (1e3, 1e4, 1e5, 1e6)
DISK_SPIN, DISK_INCLINATION, DISK_REACH = 0.9, 70.0, 20.0

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
    """Light of a disk by pixels of Gyoto, NaN where they miss it: constants of photons, intensity, radius."""

    b: Array
    q: Array
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
    rays = rays_of_directions(observer, sky, end=kc.EquatorialPlane(1))
    assert rays.radius is not None
    return rays.radius, rays.azimuth


def away(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Distances of places that both found, within the radii of a disk."""
    gap = np.abs(one[0] * np.exp(1j * one[1]) - other[0] * np.exp(1j * other[1]))
    return gap[np.isfinite(gap) & (one[0] < 100) & (one[0] > 2.5)]


def at_infinity(nearer: Array, farther: Array) -> Array:
    """Values for an observer at infinity, from two at RADII[-2] and RADII[-1], by a straight line in 1/r."""
    nearest, farthest = RADII[-2:]
    return farther + (farther - nearer) * nearest / (farthest - nearest)


def compare_kerrz() -> None:
    """Observers at several radii, and the one at infinity."""
    line = (np.arange(SIDE) + 0.5) / SIDE * 2 * HALF_WIDTH - HALF_WIDTH
    alpha, beta = np.meshgrid(line, line)
    places = alpha.ravel(), beta.ravel()
    try:
        theirs = [kerrz(places, radius)[:2] for radius in RADII]
    except ImportError as error:
        print(f"kerrz: skipped, {error}")
        return
    limit = landings(observer_at(SPIN, INCLINATION), places)
    for radius, found in zip(RADII, theirs, strict=True):
        same = away(landings(observer_at(SPIN, INCLINATION, radius), places), found)
        far = away(limit, found)
        print(
            f"kerrz at r = {radius:g}, {len(same)} rays: from an observer there {np.median(same):.1e} M in the median, "
            f"{same.max():.1e} M at most; from one at infinity {np.median(far) * radius:.1f} M / r"
        )
    last = at_infinity(*(radius * np.exp(1j * azimuth) for radius, azimuth in theirs[-2:]))
    gap = away(limit, (np.abs(last), np.angle(last)))
    print(
        f"kerrz extrapolated, from an observer at infinity: {np.median(gap):.1e} M in the median, "
        f"{gap.max():.1e} M at most"
    )


def gyoto_disk(distance: float, side: int = 48) -> Light:
    """The disk as Gyoto renders it for an observer at a radius; rows from below, an even number of them."""
    from astropy.io import fits

    theta, field = math.radians(DISK_INCLINATION), 2 * DISK_REACH / distance
    text = SCENERY.format(spin=DISK_SPIN, radius=distance, theta=theta, field=field, side=side)
    with tempfile.TemporaryDirectory() as folder:
        scene, output = Path(folder, "scene.xml"), Path(folder, "out.fits")
        scene.write_text(text, encoding="utf-8")
        subprocess.run(["gyoto", "--quiet", "-T1", str(scene), str(output)], check=True, capture_output=True)
        intensity = np.array(fits.getdata(output, 0), float).ravel()
        ends = np.array(fits.getdata(output, 1), float).reshape(-1, 16)[:, 8:]
    met = np.all(np.isfinite(ends), axis=1) & (np.abs(ends[:, 1]) < distance) & (intensity > 0)
    ends[~met] = np.nan
    return Light(*constants_of(ends, DISK_SPIN), np.where(met, intensity, np.nan), ends[:, 1])


def light_of_disk(observer: kc.Observer, sky: Array) -> tuple[Array, Array]:
    """Radii (n,) where rays first meet the plane, and bolometric intensities of a disk of Page & Thorne there."""
    beams = beams_of_directions(observer, sky, end=kc.EquatorialPlane(1))
    assert beams.radius is not None and beams.redshift is not None
    return beams.radius, beams.redshift**4 * page_thorne_flux(DISK_SPIN, beams.radius)


def print_disk(what: str, observer: kc.Observer, light: Light) -> None:
    """Differences of intensities along rays that Gyoto traced from its own, after one factor."""
    theta_sign = np.repeat([-1.0, 1.0], len(light.b) // 2)
    met = np.isfinite(light.intensity)
    b, q, intensity, theirs = (values[met] for values in light)
    radius, own = light_of_disk(observer, sky_of(observer, b, q, theta_sign[met]))
    # The same crossing of the plane; next to the ISCO the light begins from nothing.
    smooth = (np.abs(radius / theirs - 1) < 1e-3) & (radius > 2.5) & (radius < 39)
    ratio = intensity[smooth] / own[smooth]
    miss = np.abs(ratio / np.median(ratio) - 1)
    print(
        f"Gyoto's disk {what}, {smooth.sum()} of {len(smooth)} rays: bolometric intensities {np.median(miss):.1e} in "
        f"the median, {miss.max():.1e} at most"
    )


def compare_disk() -> None:
    """Intensities along the rays that Gyoto traced, seen from its observer's radius and from infinity."""
    if shutil.which("gyoto") is None:
        print("Gyoto: skipped, there is no command gyoto")
        return
    lights = [gyoto_disk(radius) for radius in RADII]
    for radius, light in zip(RADII, lights, strict=True):
        print_disk(f"at r = {radius:g}", observer_at(DISK_SPIN, DISK_INCLINATION, radius), light)
    last = Light(*(at_infinity(*pair) for pair in zip(*lights[-2:], strict=True)))
    print_disk("extrapolated to infinity", observer_at(DISK_SPIN, DISK_INCLINATION), last)


if __name__ == "__main__":
    compare_kerrz()
    compare_disk()
