"""The light of a band with a profile: rays at nodes on chords from its inner to its outer edge.

Chords are lines across the shadow edge. Each is divided where the matter's motion changes its law, at the innermost
stable orbit, and at radii in proportion; the images of these circles are found as the edges are.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.lens_map.plane_edges import CrossingCircles, distances
from kerrcaustics.lens_map.plane_map import plane_rays
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.lens_map.sky_lines import Lines
from kerrcaustics.numerics import fourier
from kerrcaustics.rings.band_edge import BandEdge, distances_on, has_point, lines_of, turns
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.observer import SCREEN

Array = np.ndarray

# Ratio of the radii at which chords are divided, and the largest one over that of the innermost stable orbit.
_RATIO, _LARGEST = 2.2, 500.0
# Circles closer to an edge than this, in ln r, divide nothing.
_CLOSE = 0.02
# Kronrod's rule of 15 nodes and Gauss' of 7 among them: nodes from the middle outward, and weights (QUADPACK, 1983).
_KRONROD_NODES = (
    *(0.0, 0.20778495500789848, 0.4058451513773972, 0.5860872354676911),
    *(0.7415311855993945, 0.8648644233597691, 0.9491079123427585, 0.9914553711208126),
)
_KRONROD = (
    *(0.20948214108472782, 0.20443294007529889, 0.19035057806478542, 0.1690047266392679),
    *(0.14065325971552592, 0.10479001032225019, 0.06309209262997856, 0.022935322010529224),
)
_GAUSS = (0.4179591836734694, 0.0, 0.3818300505051189, 0.0, 0.27970539148927664, 0.0, 0.1294849661688697, 0.0)


class LightNodes(NamedTuple):
    """Nodes of a sum over a band.

    place: places on the screen, M.
    weight: intensity times area.
    lower_weight: the same by the lower rule, 0 at every second node of a chord.
    error: of the sum, by errors of the edges and by rays that are not known.
    """

    place: Float[Array, "lines nodes 2"]
    weight: Float[Array, "lines nodes"]
    lower_weight: Float[Array, "lines nodes"]
    error: float


def light_nodes(
    inner: BandEdge,
    outer: BandEdge,
    count: int,
    brightness: Callable[[Array, Array, Array], Array],
    motion: str,
    most_rays: int,
) -> LightNodes:
    """Nodes on so many chords, with the light of rays there; ValueError if there are too many of them."""
    radii, (rule, kronrod, gauss) = _dividing_radii(inner, outer, motion), _rule()
    rays = count * (len(radii) + 1) * len(rule)
    if rays > most_rays:
        raise ValueError(
            f"Argument `u` must make shorter baselines: they need {rays} rays between the edges of order "
            f"{inner.order}, and {most_rays} is the limit."
        )
    lines = lines_of(inner, count)
    ends = _ends(inner, outer, lines, radii)
    half = np.diff(ends, axis=1)[..., None] / 2
    distance = (ends[:, :-1, None] + half * (1 + rule)).reshape(count, -1)
    intensity, lost = _intensity(inner, lines, distance, brightness, motion)
    angle = distance - lines.first[:, None]
    size = 2 * SCREEN * np.tan(angle / 2)
    turn, step = turns(lines)
    area = size * SCREEN / np.cos(angle / 2) ** 2 * step[:, None]
    place = size[..., None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None]
    intensity = np.where(lost, 0, intensity)
    upper, lower = (area * (half * weight).reshape(count, -1) for weight in (kronrod, gauss))
    brightest = np.abs(intensity).max()
    unknown = float(np.abs(upper[lost]).sum())
    around = 2 * np.pi * size.max() * float(inner.error.max() + outer.error.max())
    return LightNodes(place, upper * intensity, lower * intensity, float(brightest * (unknown + around)))


def _rule() -> tuple[Array, Array, Array]:
    """Nodes in order and both sets of weights."""
    nodes, kronrod, gauss = (np.array(part) for part in (_KRONROD_NODES, _KRONROD, _GAUSS))
    return (
        np.concatenate([-nodes[:0:-1], nodes]),
        np.concatenate([kronrod[:0:-1], kronrod]),
        np.concatenate([gauss[:0:-1], gauss]),
    )


def _ends(inner: BandEdge, outer: BandEdge, lines: Lines, radii: Float[Array, " radii"]) -> Float[Array, "lines ends"]:
    """Distances on lines at which chords begin, are divided and end."""
    camera = inner.camera
    near, far = distances_on(inner, lines), distances_on(outer, lines)
    columns = [near, far]
    if len(radii):
        crossing = np.full(len(radii), inner.order + 1)
        between = distances(camera, lines, CrossingCircles(crossing, radii))
        if camera.on_equator:
            below = fourier.nodes(len(lines)) > np.pi
            lower = (
                near[:, None] if has_point(inner) else distances(camera, lines, CrossingCircles(crossing - 1, radii))
            )
            between = np.where(below[:, None], lower, between)
        columns[1:1] = list(between.T)
    return np.stack(columns, axis=1)


def _dividing_radii(inner: BandEdge, outer: BandEdge, motion: str) -> Float[Array, " radii"]:
    last = kerr.isco(inner.camera.spin, not motion.startswith("retrograde"))
    steps = np.arange(-3, 1 + math.log(_LARGEST) // math.log(_RATIO))
    radii = last * _RATIO**steps
    with np.errstate(divide="ignore"):
        apart = np.minimum(np.log(radii / inner.radius), np.log(outer.radius / radii))
    return radii[apart > _CLOSE]


def _intensity(
    edge: BandEdge,
    lines: Lines,
    distance: Float[Array, "lines nodes"],
    brightness: Callable[[Array, Array, Array], Array],
    motion: str,
) -> tuple[Array, Array]:
    """Intensities of rays at distances along lines, and True where no ray is known to cross the plane there."""
    camera = search_sky(edge.camera).search_camera
    sky, below = lines.sky(distance), fourier.nodes(len(lines)) > np.pi
    parts = [np.ones(len(lines), bool)]
    if camera.on_equator:
        parts = [~below, below] if not has_point(edge) else [~below]
    found = np.full((3, *distance.shape), np.nan)
    for number, rows in enumerate(parts):
        rays = plane_rays(camera, sky[rows], EquatorialPlane(edge.order + 1 - number, motion), redshift=True)
        found[:, rows] = rays.radius, rays.azimuth, rays.redshift
    lost = np.isnan(found[0])
    values = np.zeros(distance.shape)
    given = np.asarray(brightness(*found[:, ~lost]), float)
    if given.shape not in ((), (int((~lost).sum()),)):
        raise ValueError(f"Argument `brightness` must return one number for each ray, but returns shape {given.shape}.")
    if not np.isfinite(given).all():
        raise ValueError(
            "Argument `brightness` must return finite numbers, but does not; matter that moves as "
            f"{motion} may not exist so close to the hole: take photon_rings with a larger `inner`, or "
            'motion="plunging".'
        )
    values[~lost] = given
    return values, lost
