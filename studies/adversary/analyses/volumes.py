"""Pictures of glowing matter, against quadrature along the paths of their pixels' middles.

Emission, absorption and the shift of frequencies are written down here again, from docs/disks.md and the metric. The
quadrature is repeated with half of the places, which gives the error of the truth.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import cumulative_simpson, simpson

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr

from ..cases import hard_spin
from .claim import Claim, Kind

# Places on a ray, odd for Simpson's rule on every second one as well.
_PLACES = 2049
# Differences between neighbours, in parts of the brightest, from which a pixel may be the mean of nine rays.
_ROUGH = 1 / 32
# Rounding of float32, in parts of the brightest.
_SINGLE = 2e-7
# A truth with a larger error, in units of the reported one, says nothing.
_KNOWN = 0.2

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


class Cloud(NamedTuple):
    """A torus of matter with waves in azimuth.

    density: largest optical depth per length.
    inner, outer: radii, where it ends smoothly.
    height: width in cos theta.
    waves: number of waves in azimuth.
    temperature: kelvin at the inner radius, falling as its square root.
    motion: "circular", "fiducial", "static", or an angular velocity.
    """

    density: float
    inner: float
    outer: float
    height: float
    waves: int
    temperature: float
    motion: str | float

    def density_at(self, radius, theta, azimuth):
        part = np.clip(np.log(radius / self.inner) / math.log(self.outer / self.inner), 0, 1)
        ring = np.sin(math.pi * part) ** 4 * np.exp(-((np.cos(theta) / self.height) ** 2) / 2)
        return self.density * ring * (1 + 0.5 * np.cos(self.waves * azimuth))

    def temperature_at(self, radius, theta, azimuth):
        return self.temperature * np.sqrt(self.inner / radius)

    def volume(self) -> kc.disks.Volume:
        size = min(self.height, math.log(self.outer / self.inner) / 4, 1 / max(self.waves, 1))
        motion: Any = self.motion
        if isinstance(motion, float):
            constant = motion
            motion = lambda radius, theta: constant + 0 * radius  # noqa: E731
        laws = self.density_at, self.temperature_at
        return kc.disks.Volume(*laws, self.inner, self.outer, scale=size * self.inner, motion=motion)


def of_clouds(rng: np.random.Generator) -> list[Claim]:
    """The light of a random cloud in a small picture, for a camera or an observer."""
    spin = hard_spin(rng)
    viewer, view = viewer_and_view(spin, rng)
    inner = float(kerr.horizon(spin) + 10 ** rng.uniform(-1, 1))
    outer = float(inner * 10 ** rng.uniform(0.2, 0.8))
    motion = str(rng.choice(["circular", "fiducial", "static", "given"]))
    depth = 10 ** rng.uniform(-2, 1.5) / (outer - inner)
    shape = float(rng.uniform(0.1, 0.6)), int(rng.integers(0, 4)), float(rng.uniform(3000, 12000))
    cloud = Cloud(depth, inner, outer, *shape, float(rng.uniform(0, 0.3)) / outer if motion == "given" else motion)
    shifts = bool(rng.integers(2)), bool(rng.integers(2))
    step = float(rng.choice([0.25, 0.5, 1.0, 2.0]))
    found = kc.pictures.render_volume(
        viewer, view, cloud.volume(), beaming=shifts[0], colour_shift=shifts[1], step=step
    )
    code = f"render_volume({viewer!r}, {in_python(view)}, {cloud!r}.volume(), {shifts}, step={step})"
    return cloud_claims(found, cloud, shifts, code)


def cloud_claims(found: Any, cloud: Cloud, shifts: tuple[bool, bool], code: str) -> list[Claim]:
    """Claims of the error of a picture, of pixels that are no mean of nine."""
    true, off = light_along_rays(found.camera, found.view, cloud, shifts)
    light, transmission = true
    grey = light @ _LUMINANCE
    brightest = max(float((found.light @ _LUMINANCE).max()), 1e-30)
    smooth = (
        ~(_rough(grey / max(float(np.nan_to_num(grey).max()), 1e-30)) | _rough(transmission))
        & np.isfinite(grey)
        & np.isfinite(transmission)
    )
    if not smooth.any() or not grey[smooth].max() > 1e-6 * brightest:
        return []
    differences = {
        "light of a volume": (np.abs(found.light @ _LUMINANCE - grey) / brightest, off[0] @ _LUMINANCE / brightest),
        "transmission of a volume": (np.abs(found.transmission - transmission), off[1]),
    }
    claims = []
    for name, (difference, doubt) in differences.items():
        known = smooth & (doubt < _KNOWN * found.error + _SINGLE)
        if known.any():
            ratio = np.maximum(difference - doubt - _SINGLE, 0)[known].max() / found.error if found.error > 0 else 0.0
            claims.append(Claim(name, float(ratio), code))
    return claims


def _rough(picture: np.ndarray) -> np.ndarray:
    """True for pixels that differ from a neighbour, or may do so."""
    mask = np.zeros(picture.shape, bool)
    for axis in (0, 1):
        edge = ~(np.abs(np.diff(picture, axis=axis)) < _ROUGH)
        mask |= np.pad(edge, [(0, 1 - axis), (0, axis)]) | np.pad(edge, [(1 - axis, 0), (axis, 0)])
    return mask


def light_along_rays(viewer: Any, view: Any, cloud: Cloud, shifts: tuple[bool, bool]) -> tuple[tuple, tuple]:
    """Light (h, w, 3) and transmission (h, w) of the middles of pixels, and the errors of both."""
    x, y = (part.ravel() for part in np.meshgrid(np.arange(view.width), np.arange(view.height)))
    sky = view.places(x, y) if isinstance(viewer, kc.Observer) else view.directions(x, y)[0]
    paths = kc.ray_paths(viewer, sky, _PLACES)
    impact = impact_of(viewer, sky)
    fine, coarse = (_summed(viewer, paths, impact, cloud, shifts, part) for part in (1, 2))
    shapes = (view.height, view.width, 3), (view.height, view.width)
    true = tuple(part.reshape(shape) for part, shape in zip(fine, shapes, strict=True))
    off = tuple(np.abs(p - q).reshape(shape) for p, q, shape in zip(fine, coarse, shapes, strict=True))
    return true, off


def _summed(viewer, paths, impact, cloud: Cloud, shifts: tuple[bool, bool], part: int) -> tuple[np.ndarray, np.ndarray]:
    """Light (n, 3) and transmission (n,) by Simpson's rule, from every place or from every second one."""
    radius, theta, azimuth, tau = (
        values[:, ::part] for values in (paths.radius, paths.theta, paths.azimuth, paths.mino_time)
    )
    here = np.isfinite(radius) & (radius > cloud.inner) & (radius < cloud.outer)
    r, polar, phi = (np.where(here, values, cloud.inner) for values in (radius, theta, azimuth))
    energy = matter_energy(
        viewer.spin, r, polar, impact[:, None], angular_velocity(viewer.spin, r, polar, cloud.motion)
    )
    sigma = r**2 + (viewer.spin * np.cos(polar)) ** 2
    possible = here & np.isfinite(energy)
    rate = np.where(possible, cloud.density_at(r, polar, phi) * energy * sigma, 0.0)
    depth = cumulative_simpson(rate, x=tau, axis=1, initial=0)
    ratio = np.where(possible, energy_of_viewer(viewer, impact)[:, None] / energy, 1.0)
    seen = seen_light(cloud.temperature_at(r, polar, phi), ratio, shifts)
    light = simpson(seen * (rate * np.exp(-depth))[..., None], x=tau[..., None], axis=1)
    return light, np.exp(-simpson(rate, x=tau, axis=1))


def seen_light(kelvin: np.ndarray, ratio: np.ndarray, shifts: tuple[bool, bool]) -> np.ndarray:
    """Light (..., 3) of black bodies seen with a ratio of frequencies, as docs/scenes.md has it."""
    beaming, colour_shift = shifts
    own = kc.pictures.black_body(kelvin)
    if not colour_shift:
        return own * (ratio**4 if beaming else np.ones_like(ratio))[..., None]
    shifted = kc.pictures.black_body(kelvin * ratio)
    return shifted if beaming else shifted * ((own @ _LUMINANCE) / (shifted @ _LUMINANCE))[..., None]


def impact_of(viewer: Any, sky: np.ndarray) -> np.ndarray:
    """Angular momentum (n,) per unit energy of light from directions or places, for a camera that circles at most."""
    if isinstance(viewer, kc.Observer):
        return -sky[:, 0] * math.sin(viewer.inclination)
    g_tt, g_tp, g_pp = components(viewer.spin, viewer.radius, viewer.inclination)
    shift, varpi = -g_tp / g_pp, math.sqrt(g_pp)
    lapse = math.sqrt(g_tp**2 / g_pp - g_tt)
    orbital = angular_velocity(viewer.spin, viewer.radius, viewer.inclination, viewer.velocity)
    speed = varpi * (orbital - shift) / lapse
    around = varpi * (speed - sky[:, 1]) / (1 - speed * sky[:, 1])
    return around / (lapse + shift * around)


def energy_of_viewer(viewer: Any, impact: np.ndarray) -> np.ndarray:
    """Energy (n,) that a viewer measures for unit energy at infinity: of an observer at infinity 1."""
    if isinstance(viewer, kc.Observer):
        return np.ones_like(impact)
    orbital = angular_velocity(viewer.spin, viewer.radius, viewer.inclination, viewer.velocity)
    return matter_energy(viewer.spin, viewer.radius, viewer.inclination, impact, orbital)


def components(spin: float, radius: Any, theta: Any) -> tuple[Any, Any, Any]:
    """g_tt, g_tphi and g_phiphi in Boyer-Lindquist coordinates."""
    square = np.sin(theta) ** 2
    sigma = radius**2 + (spin * np.cos(theta)) ** 2
    drag = 2 * spin * radius * square / sigma
    return -(1 - 2 * radius / sigma), -drag, square * (radius**2 + spin**2 + spin * drag)


def angular_velocity(spin: float, radius: Any, theta: Any, motion: str | float) -> Any:
    """dphi / dt of matter in a motion that has a name, or is a number."""
    if not isinstance(motion, str):
        return motion + 0 * radius
    away = radius * np.abs(np.sin(theta))
    if motion in ("circular", "retrograde"):
        return 1 / (spin + away**1.5) if motion == "circular" else 1 / (spin - away**1.5)
    _, g_tp, g_pp = components(spin, radius, theta)
    return -g_tp / g_pp if motion == "fiducial" else 0 * radius


def matter_energy(spin: float, radius: Any, theta: Any, impact: Any, orbital: Any) -> Any:
    """Energy that matter on circles measures for unit energy at infinity; NaN if it would be as fast as light."""
    g_tt, g_tp, g_pp = components(spin, radius, theta)
    slow = -(g_tt + 2 * g_tp * orbital + g_pp * orbital**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return (1 - orbital * impact) / np.sqrt(np.where(slow > 0, slow, np.nan))


def viewer_and_view(spin: float, rng: np.random.Generator, pixels: tuple[int, int] = (8, 6)) -> tuple[Any, Any]:
    """A camera with a view toward the hole, or beside it, or an observer at infinity with a screen."""
    inclination = float(rng.choice([math.acos(rng.uniform(-1, 1)), math.pi / 2, 1e-3 + 0.05 * rng.uniform()]))
    if rng.uniform() < 0.3:
        aside = rng.normal(size=2) * 6
        return kc.Observer(spin, inclination), kc.Screen(*pixels, float(10 ** rng.uniform(-0.5, 1.3)), aside.tolist())
    radius = float(kerr.horizon(spin) * 1.02 + 10 ** rng.uniform(-0.5, 2))
    camera = kc.Camera(spin, radius, inclination, "fiducial")
    if radius > 2.2:
        camera = kc.Camera(spin, radius, inclination, str(rng.choice(["fiducial", "static"])))
    middle = np.array([-1.0, 0, 0]) + rng.normal(size=3) * min(6 / radius, 0.7)
    field = float(min(10 ** rng.uniform(-1, 0.3) * 6 / radius, 1.0))
    return camera, kc.pictures.View(*pixels, field, forward=middle.tolist())


def in_python(view: Any) -> str:
    """A view or a screen in words that Python reads, with all digits."""
    if isinstance(view, kc.Screen):
        return f"kc.Screen({view.width}, {view.height}, {view.size!r}, {view.centre.tolist()!r})"
    axes = f"forward={view.forward.tolist()!r}, up={view.up.tolist()!r}"
    return f"kc.pictures.View({view.width}, {view.height}, {view.field_of_view!r}, {view.projection!r}, {axes})"


KINDS: dict[str, Kind] = {"volumes": of_clouds}
