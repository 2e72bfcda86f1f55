"""Pixels of pictures: of a smooth sky and of a disk, against rays, and motion blur against many short exposures.

Pictures have no error for each pixel. Held are the statements of docs/scenes.md and docs/disks.md: the map of the sky
is off by `error` pixels at most; 95 of 100 pixels on rims and next to the shadow agree with 64 x 64 rays to 1 % or
1/255 of the brightest; a turning disk differs from its mean over time by 0.8 %, a sky by 1 % of its light. The ratio of
a claim is the difference over that.
"""

import math
from typing import Any, NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr

from ..cases import hard_spin
from .claim import Claim, Kind
from .volumes import (
    angular_velocity,
    energy_of_viewer,
    impact_of,
    in_python,
    matter_energy,
    viewer_and_view,
)

# Footprints, in radians, and second differences over a pixel, in its width, for which a pixel is its middle.
_SMALL, _STRAIGHT = 0.03, 0.1
# Largest slope, and half of the largest second derivative, of a sky.
_SLOPE, _CURVE = 1.2, 0.6
# The beams' tolerance, and rounding of float32.
_TOLERANCE, _SINGLE = 1e-7, 5e-7
# Rays on each side of a pixel, pixels of a frame that are compared, and crossings.
_SIDE, _PIXELS, _CROSSINGS = 64, 24, 8
# Parts that two numbers may differ by: relative, and of the brightest.
_HUNDREDTH, _GREY = 0.01, 1 / 255
# Of 24 pixels, the number beyond those two that 95 of 100 allow: 3 are fewer than one time in ten.
_ALLOWED = 2
# Exposures of a picture with motion blur, and its stated difference, of a disk and of a sky.
_MOMENTS, _DISK_BLUR, _SKY_BLUR = 64, 0.008, 0.01
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


class SmoothSky(NamedTuple):
    """Light 1 + b . n / 2 + (c . n)^2 / 3 of a direction n, with unit vectors b and c."""

    first: tuple[float, float, float]
    second: tuple[float, float, float]

    def light(self, n: np.ndarray) -> np.ndarray:
        grey = 1 + n @ np.array(self.first) / 2 + (n @ np.array(self.second)) ** 2 / 3
        return np.repeat(grey[..., None], 3, axis=-1)

    def sky(self) -> kc.skies.FunctionSky:
        return kc.skies.FunctionSky(self.light, detail=0.3)


def of_skies(rng: np.random.Generator) -> list[Claim]:
    """Pixels of a smooth sky, on a screen or in a view."""
    viewer, view = viewer_and_view(hard_spin(rng), rng, (24, 16))
    sky = SmoothSky(*(tuple(_unit(rng.normal(size=3)).tolist()) for _ in range(2)))
    beaming, quality = bool(rng.integers(2)), str(rng.choice(["normal", "high", "draft"]))
    radius = math.inf
    if isinstance(viewer, kc.Camera) and rng.uniform() < 0.3:
        radius = float(max(viewer.radius, 4.0) * (1 + 10 ** rng.uniform(-0.5, 2)))
    found = kc.render(viewer, view, sky.sky(), beaming=beaming, quality=quality, sky_radius=radius)
    options = f"beaming={beaming}, quality={quality!r}, sky_radius={radius!r}"
    return sky_claims(found, sky, beaming, f"kc.render({viewer!r}, {in_python(view)}, {sky!r}.sky(), {options})")


def sky_claims(found: Any, sky: SmoothSky, beaming: bool, code: str) -> list[Claim]:
    """Claims of a picture's error, of pixels that see little of the sky, and all of it straight."""
    viewer, view = found.camera, found.view
    x, y = (part.ravel().astype(float) for part in np.meshgrid(np.arange(view.width), np.arange(view.height)))
    end = math.inf if math.isinf(found.sky_radius) else float(found.sky_radius)
    middle, *beside = (
        kc.trace_rays(viewer, _places(view, x + dx, y + dy), "integrated", 1e-10, end=end).direction
        for dx, dy in ((0, 0), (0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5))
    )
    steps = [one - other for one, other in (beside[:2], beside[2:])]
    bends = [4 * (one + other - 2 * middle) for one, other in (beside[:2], beside[2:])]
    size, bent = (np.linalg.norm(np.stack(parts, axis=-1), axis=(1, 2)) for parts in (steps, bends))
    with np.errstate(invalid="ignore"):
        good = (found.visible_fraction.ravel() == 1) & (size < _SMALL) & (bent < _STRAIGHT * size)
    if not good.any():
        return []
    ratio = (
        _frequency_ratio(viewer, _places(view, x, y)[good], middle[good], end) ** 4 if beaming else np.ones(good.sum())
    )
    true = sky.light(middle[good])[:, 0] * ratio
    # The frequency ratio changes over a pixel too.
    varied = 1.0 if not beaming else 4.0
    allowed = found.error * size * _SLOPE + _CURVE * size**2 + varied * (_TOLERANCE + _SINGLE) + bent**2
    off = np.abs(found.light.reshape(-1, 3)[good, 0] - true) / ratio
    return [Claim("pixels of a sky", float((off / allowed[good]).max()), code)]


def _frequency_ratio(viewer: Any, sky: np.ndarray, n: np.ndarray, end: float) -> np.ndarray:
    """nu_camera / nu_source (n,) of sources at rest at infinity or on a sphere."""
    ratio = energy_of_viewer(viewer, impact_of(viewer, sky))
    if math.isinf(end):
        return ratio
    return ratio * np.sqrt(1 - 2 * end / (end**2 + (viewer.spin * n[:, 2]) ** 2))


def _places(view: Any, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Places on a screen, or directions in a view, as `trace_rays` takes them."""
    return view.places(x, y) if isinstance(view, kc.Screen) else view.directions(x, y)[0]


class Spiral(NamedTuple):
    """A disk with a spiral of light, which is 1 + contrast cos(arms phi - 3 ln r)."""

    inner: float
    outer: float
    arms: int
    contrast: float
    opacity: float
    motion: Any

    def light(self, radius: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
        grey = 1 + self.contrast * np.cos(self.arms * azimuth - 3 * np.log(radius))
        return np.repeat(grey[:, None], 3, axis=1)

    def disk(self) -> kc.disks.Disk:
        emission = kc.disks.FunctionEmission(self.light, detail=self.inner / (2 + 2 * self.arms))
        return kc.disks.Disk(self.inner, self.outer, emission, self.opacity, self.motion, slant=False)


def of_disks(rng: np.random.Generator) -> list[Claim]:
    """Pixels of a disk: on rims, next to the shadow, and within."""
    spin = hard_spin(rng)
    viewer, view = viewer_and_view(spin, rng, (32, 24))
    spiral = random_spiral(spin, rng)
    beaming = bool(rng.integers(2))
    found = kc.render(viewer, view, disk=spiral.disk(), beaming=beaming)
    code = f"kc.render({viewer!r}, {in_python(view)}, disk={spiral!r}.disk(), beaming={beaming})"
    return disk_claims(found, spiral, beaming, rng, code)


def random_spiral(spin: float, rng: np.random.Generator) -> Spiral:
    """A disk of any size, in any motion that is possible there: elsewhere it is dark, without a rim."""
    motion = str(rng.choice(["circular", "retrograde", "static"]))
    prograde, retrograde = kerr.photon_orbits(spin)
    least = {"circular": prograde, "retrograde": retrograde, "static": 2.0}[motion]
    inner = float(max(least, kerr.horizon(spin)) * 1.02 + 10 ** rng.uniform(-2, 1))
    opacity = float(rng.choice([1.0, 1.0, 0.0, rng.uniform()]))
    return Spiral(inner, float(inner * 10 ** rng.uniform(0.05, 0.8)), int(rng.integers(0, 4)), 0.8, opacity, motion)


def disk_claims(found: Any, spiral: Spiral, beaming: bool, rng: np.random.Generator, code: str) -> list[Claim]:
    """The claim of rims, edges and all else: what all but two of 24 pixels keep to."""
    grey = found.light @ _LUMINANCE
    brightest = float(grey.max())
    if not brightest > 0:
        return []
    steep = np.hypot(*np.gradient(grey)).ravel()
    lit = np.flatnonzero(grey.ravel())
    rims = np.flatnonzero(steep > 0.2 * steep.max()) if steep.max() > 0 else lit
    pixels = np.unique(np.concatenate([rng.choice(rims, _PIXELS // 2), rng.choice(lit, _PIXELS // 2)]))
    true = light_of_rays(found.camera, found.view, spiral, beaming, pixels)
    off = np.abs(grey.ravel()[pixels] - true) / np.maximum(_HUNDREDTH * true, _GREY * brightest)
    allowed = _ALLOWED * len(pixels) // _PIXELS
    return [Claim("pixels of a disk", float(np.sort(off)[-1 - allowed]), code)]


def light_of_rays(viewer: Any, view: Any, spiral: Spiral, beaming: bool, pixels: np.ndarray) -> np.ndarray:
    """Luminance (n,) of pixels: means over rays, each with the light of every crossing that is not hidden."""
    within = (np.arange(_SIDE) + 0.5) / _SIDE - 0.5
    y, x = (part[:, None, None] for part in np.divmod(pixels, view.width))
    sky = _places(view, *(part.ravel() for part in np.broadcast_arrays(x + within, y + within[:, None])))
    light, passing, live = np.zeros(len(sky)), np.ones(len(sky)), np.arange(len(sky))
    for crossing in range(1, _CROSSINGS + 1):
        rays = kc.trace_rays(viewer, sky[live], end=kc.EquatorialPlane(crossing))
        with np.errstate(invalid="ignore"):
            on = (rays.radius >= spiral.inner) & (rays.radius <= spiral.outer)
        here, radius = live[on], rays.radius[on]
        bright = spiral.light(radius, rays.azimuth[on])[:, 0]
        if beaming:
            bright = bright * disk_ratio(viewer, sky[here], radius, spiral.motion) ** 4
        light[here] += passing[here] * np.nan_to_num(bright)
        passing[here] *= 1 - spiral.opacity
        live = live[np.isfinite(rays.radius)]
        live = live[passing[live] > 0]
        if not len(live):
            break
    return light.reshape(len(pixels), -1).mean(axis=1)


def disk_ratio(viewer: Any, sky: np.ndarray, radius: np.ndarray, motion: str) -> np.ndarray:
    """nu_camera / nu_emitter (n,) of matter on circles in the plane; NaN where there is no such motion."""
    impact, plane = impact_of(viewer, sky), math.pi / 2
    orbital = angular_velocity(viewer.spin, radius, plane, motion)
    return energy_of_viewer(viewer, impact) / matter_energy(viewer.spin, radius, plane, impact, orbital)


def of_shutters(rng: np.random.Generator) -> list[Claim]:
    """A picture with motion blur, of a turning disk, or of a sky for a camera that moves."""
    spin = hard_spin(rng)
    radius = float(6 + 20 * rng.uniform())
    inclination = float(rng.uniform(0.3, 1.4))
    if rng.uniform() < 0.5:
        camera = kc.Camera(spin, radius, inclination, "static")
        view = kc.pictures.View(96, 60, float(min(30 / radius, 2.0)))
        inner = float(max(kerr.isco(spin), 2.5) * rng.uniform(1, 1.5))
        spiral = Spiral(inner, inner * 2.0, int(rng.integers(1, 4)), 0.8, 1.0, "circular")
        return turning_disk_claims(camera, view, spiral, float(rng.uniform(0.05, 1.0) * 6 * inner**1.5 / 10))
    view = kc.pictures.View(96, 60, 1.4)
    turn, fall = float(rng.uniform(0, 0.08)), float(rng.uniform(0, 0.2))
    return moving_camera_claims(spin, (radius, inclination), view, (turn, fall))


def turning_disk_claims(camera: kc.Camera, view: Any, spiral: Spiral, exposure: float) -> list[Claim]:
    """The mean difference of a turning disk from the mean of short exposures, over the stated one."""
    disk, half = spiral.disk(), exposure / 2
    motion = kc.pictures.ShutterMotion((camera, camera), (view, view), times=(-half, half))
    found = kc.render(camera, view, disk=disk, motion=motion).light
    traced = kc.pictures.trace_view(camera, view, sky=False, disk=disk)
    times = ((np.arange(_MOMENTS) + 0.5) / _MOMENTS - 0.5) * exposure
    true = np.mean([traced.show(disk=disk, time=float(t)).light.astype(float) for t in times], axis=0)
    code = f"kc.render({camera!r}, {in_python(view)}, disk={spiral!r}.disk(), motion=...(times=({-half}, {half})))"
    return [Claim("motion blur of a disk", _mean_difference(found, true) / _DISK_BLUR, code)]


def moving_camera_claims(spin: float, place: tuple[float, float], view: Any, moves: tuple[float, float]) -> list[Claim]:
    """The mean difference of a smooth sky, for a camera that circles and falls, over the stated one."""
    (radius, inclination), (turn, fall) = place, moves
    pattern = kc.skies.Checkerboard()

    def camera(t: float) -> kc.Camera:
        return kc.Camera(spin, radius - fall * t, inclination, "fiducial")

    ends = (-0.5, 0.5)
    views, azimuths = (view, view), (turn * ends[0], turn * ends[1])
    motion = kc.pictures.ShutterMotion((camera(ends[0]), camera(ends[1])), views, azimuths)
    found = kc.render(camera(0.0), view, pattern, motion=motion).light
    pictures = []
    for t in (np.arange(_MOMENTS // 2) + 0.5) / (_MOMENTS // 2) - 0.5:
        shown = kc.render(camera(float(t)), view, kc.skies.TurnedSky(pattern, -turn * float(t)))
        pictures.append(shown.light.astype(float))
    code = f"motion from {camera(-0.5)!r} to {camera(0.5)!r}, azimuths {azimuths}, {in_python(view)}, Checkerboard()"
    return [Claim("motion blur of a sky", _mean_difference(found, np.mean(pictures, axis=0)) / _SKY_BLUR, code)]


def _mean_difference(found: np.ndarray, true: np.ndarray) -> float:
    """Mean difference of luminance over the mean luminance."""
    return float(np.abs((found - true) @ _LUMINANCE).mean() / (true @ _LUMINANCE).mean())


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


KINDS: dict[str, Kind] = {
    "screens and views": of_skies,
    "frames with disks": of_disks,
    "shutters": of_shutters,
}
