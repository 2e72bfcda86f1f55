"""Photon rings, and what an interferometer sees of them, by bisection of integrated rays on half-lines."""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.rings.results import PhotonBand, PhotonRings
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.viewer import Viewer

from .claim import Claim, Kind
from .half_lines import UNKNOWN, WITHIN, CircleOnLines, HalfLines, area_between, circle_on, half_lines, shadow_on, sides
from .hard_viewers import Random, hard_radius, hard_viewer, one_of

Array = np.ndarray

_LINES, _POINTS, _PLACES = 96, 24, 300
# Rays per half-line between the edges of a band, and baselines.
_ON_CHORD, _BASELINES = 20, 5
# Difference of widths from half as many places, relative, beyond which a curve has corners.
_RESOLVED = 1e-10


def photon_ring_claims(rng: Random) -> list[Claim]:
    """Areas, edges, diameters and masks of the bands of a hard viewer."""
    rings, code = _rings(rng, hard_viewer(rng, -4.0))
    lines = half_lines(rings.camera, _LINES, _last(rings))
    if lines is None:
        return []
    claims, shadow = [], shadow_on(lines)
    for band in rings:
        circles = [circle_on(lines, shadow, band.order + 1, radius) for radius in _radii(rings)]
        inner, outer = circles
        name = f"{code}[{band.order}]"
        if not band.certified:
            continue
        if inner is not None and outer is not None and band.outer is not None:
            area, off = area_between(lines, inner, outer)
            claims.append(Claim("area", abs(band.solid_angle - area) / (band.solid_angle_error + off), name))
        claims += _edge_claims(rings, band, lines, rng, name)
        claims += _mask_claims(rings, band, lines, circles, rng, code)
    return claims + _diameter_claims(rings, lines, shadow, code)


def _rings(rng: Random, viewer: Viewer) -> tuple[PhotonRings, str]:
    horizon, radius = kerr.horizon(viewer.spin), hard_radius(viewer.spin, rng)
    inner = None if rng.uniform() < 0.4 else radius
    least = horizon if inner is None else inner
    outer = one_of(rng, math.inf, least * (1 + 10 ** rng.uniform(-3, 1)), least + 10 ** rng.uniform(0, 2))
    orders = int(rng.integers(0, 4))
    rings = kc.photon_rings(viewer, max_order=orders, inner=inner, outer=outer)
    return rings, f"kc.photon_rings({viewer!r}, max_order={orders}, inner={inner!r}, outer={outer!r})"


def _radii(rings: PhotonRings) -> tuple[float, float]:
    """Radii for `circle_on`, to which the horizon is 0."""
    return (0.0 if rings.inner == kerr.horizon(rings.camera.spin) else rings.inner), rings.outer


def _last(rings: PhotonRings) -> float:
    """Beyond all images on a screen, as far as they have an end."""
    size = rings.outer if math.isfinite(rings.outer) else rings.inner
    return 3 * size + 100.0


def _edge_claims(rings: PhotonRings, band: PhotonBand, lines: HalfLines, rng: Random, code: str) -> list[Claim]:
    """Points of the edges: across them, to where rays on the half-line through each change sides."""
    claims = []
    for edge, radius, name in zip(band.rims, _radii(rings), ("inner", "outer"), strict=False):
        chosen = rng.integers(len(edge.sky), size=_POINTS)
        own, distance = _through(lines, edge.sky[chosen])
        # Of a point behind the last half-line, or in the middle, nothing is said.
        circle = circle_on(own, shadow_on(own), band.order + 1, radius)
        if circle is None or (distance > 0.999 * lines.last).any():
            continue
        off = np.abs(distance - circle.distance) * _across(edge.sky, chosen, own, distance)
        ratio = off / (edge.error[chosen] + circle.error)
        worst = int(np.argmax(ratio))
        claims.append(Claim("edge", float(ratio[worst]), f"{code}.{name}.sky[{chosen[worst]}]"))
    return claims


def _through(lines: HalfLines, places: Array) -> tuple[HalfLines, Array]:
    """The half-lines through places, and their distances from the centre."""
    if len(lines.centre) == 2:
        away = places - lines.centre
        return lines._replace(angle=np.arctan2(away[:, 1], away[:, 0])), np.hypot(*away.T)
    first, second = kc.tangent_basis(lines.centre)
    distance = 2 * np.arcsin(np.minimum(np.linalg.norm(places - lines.centre, axis=1) / 2, 1))
    return lines._replace(angle=np.arctan2(places @ second, places @ first)), distance


def _across(sky: Array, chosen: Array, lines: HalfLines, distance: Array) -> Array:
    """Sine of the angle between half-lines and the curve, from the neighbours of its points."""
    along = sky[(chosen + 1) % len(sky)] - sky[chosen - 1]
    step = 1e-6 * (1 + distance)
    outward = lines.at(distance + step) - lines.at(distance - step)
    along, outward = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (along, outward))
    return np.sqrt(np.maximum(1 - (along * outward).sum(axis=1) ** 2, 0.0))


def _mask_claims(
    rings: PhotonRings,
    band: PhotonBand,
    lines: HalfLines,
    circles: list[CircleOnLines | None],
    rng: Random,
    code: str,
) -> list[Claim]:
    """Places on half-lines, beside edges and anywhere: whether they are in the band."""
    which = rng.integers(len(lines.angle), size=_PLACES)
    near = [circle for circle in circles if circle is not None]
    part = rng.uniform(size=_PLACES)
    distance = part**2 * lines.last
    if near:
        circle = near[int(rng.integers(len(near)))]
        beside = circle.beyond[which] * (1 + rng.choice([-1, 1], _PLACES) * 10 ** rng.uniform(-8, -1, _PLACES))
        distance = np.where(part < 0.7, circle.edge[which] + beside, distance)
    own = lines.some(which)
    places = own.at(np.clip(distance, 0, 0.999 * lines.last))
    signs = [sides(rings.camera, places, band.order + 1, radius) for radius in _radii(rings)]
    known = (signs[0] != UNKNOWN) & (signs[1] != UNKNOWN)
    wrong = known & (rings.mask(places)[band.order] != ((signs[0] != WITHIN) & (signs[1] == WITHIN)))
    first = places[np.argmax(wrong)].tolist()
    return [Claim("mask", math.inf if wrong.any() else 0.0, f"{code}.mask({first!r})[{band.order}]")]


def _diameter_claims(rings: PhotonRings, lines: HalfLines, shadow: Array, code: str) -> list[Claim]:
    """Projected diameters of the inner edges on a screen, from as many places and from half of them."""
    if len(lines.centre) == 3:
        return []
    claims, angle = [], np.linspace(0, math.pi, 5)[:-1]
    said = rings.diameter(angle)
    for band in rings:
        circle = circle_on(lines, shadow, band.order + 1, _radii(rings)[0])
        if circle is None or band.inner is None or not band.certified:
            continue
        sizes = [_widths(lines, circle.distance, angle, step) for step in (1, 2)]
        coarse = np.abs(sizes[0] - sizes[1])
        if coarse.max() > _RESOLVED * sizes[0].max():
            continue
        ratio = np.abs(said.inner[band.order] - sizes[0]) / (
            2 * band.inner.error.max() + coarse + 2 * circle.error.max()
        )
        claims.append(Claim("diameter", float(ratio.max()), f"{code}.diameter({angle.tolist()}).inner[{band.order}]"))
    return claims


def _widths(lines: HalfLines, distance: Array, angle: Array, step: int) -> Array:
    """Widths of a closed curve along angles, by its Fourier series through every so many places."""
    few = lines.at(distance)[::step]
    series = np.fft.rfft(few, axis=0) / len(few) * np.where(np.arange(len(few) // 2 + 1) > 0, 2, 1)[:, None]
    # Places between which a curve changes little, then ever finer about the farthest.
    onto, part = np.stack([np.cos(angle), np.sin(angle)]), np.linspace(-1, 1, 41)[:, None]
    turn = np.linspace(0, 2 * np.pi, 40 * len(few), endpoint=False)[:, None] + 0 * angle
    farthest = []
    for sign in (1, -1):
        at, reach, along = turn, 2 * np.pi / len(turn), 0 * turn
        for _ in range(4):
            along = sign * np.einsum("mka,ak->mk", _on_series(series, at), onto)
            best = np.take_along_axis(at, np.argmax(along, axis=0)[None], axis=0)
            at, reach = best + reach * part, reach / 20
        farthest.append(along.max(axis=0))
    return farthest[0] + farthest[1]


def _on_series(series: Array, turn: Array) -> Array:
    """Places (..., axes) of a curve at turns (...)."""
    return np.real(np.exp(1j * turn[..., None] * np.arange(len(series))) @ series)


def _law(radius: Array, azimuth: Array, redshift: Array) -> Array:
    """A brightness of the matter."""
    return radius**-2 * (1 + 0.5 * np.cos(azimuth)) * redshift**3


def visibility_claims(rng: Random) -> list[Claim]:
    """Visibilities of bands, uniform and with a brightness, against sums over rays between their edges."""
    viewer = hard_viewer(rng, -2.0)
    viewer = kc.Observer(spin=viewer.spin, inclination=viewer.inclination, radius=max(viewer.radius, 50.0))
    rings, code = _rings(rng, viewer)
    if rings.outer > 1e3 or not rings.certified:
        return []
    order = int(rng.integers(len(rings)))
    u, v = rng.normal(size=(2, _BASELINES)) * 10 ** rng.uniform(-3, 0.3)
    graded = rings.inner > 1.01 * kerr.horizon(viewer.spin) and rng.uniform() < 0.5
    shown = {"brightness": _law, "motion": "plunging"} if graded else {}
    seen = kc.ring_visibility(rings, u, v, order=order, **shown)
    lines = half_lines(viewer, 4 * _LINES, _last(rings))
    true = None if lines is None else _true_visibility(rings, order, lines, u, v, graded)
    if true is None:
        return []
    ratio = np.abs(seen.value[0] - true[0]) / (seen.error[0] + true[1])
    words = f"kc.ring_visibility({code}, {u.tolist()}, {v.tolist()}, order={order}"
    name = "visibility of a profile" if graded else "visibility"
    return [Claim(name, float(ratio.max()), words + (', brightness=_law, motion="plunging")' if graded else ")"))]


def _true_visibility(
    rings: PhotonRings, order: int, lines: HalfLines, u: Array, v: Array, graded: bool
) -> tuple[Array, Array] | None:
    """Sums over rays and their errors: from half of the lines, from fewer rays on each, and of the edges."""
    shadow = shadow_on(lines)
    inner, outer = (circle_on(lines, shadow, order + 1, radius) for radius in _radii(rings))
    if inner is None or outer is None:
        return None
    sums, light = [], np.zeros(len(shadow))
    for count in (_ON_CHORD, _ON_CHORD - 6):
        node, weight = np.polynomial.legendre.leggauss(count)
        gap = outer.beyond - inner.beyond
        distance = inner.distance + gap * (1 + node[:, None]) / 2
        places = lines.at(distance)
        part = weight[:, None] * gap / 2 * distance * 2 * math.pi / len(shadow)
        bright = _brightness(rings, order, places) if graded else np.ones(distance.shape)
        if not np.isfinite(bright).all():
            return None
        # Alpha points to the west.
        phase = 2 * math.pi * (-places[..., :1] * u + places[..., 1:] * v)
        terms = (part * bright)[..., None] * np.exp(-1j * phase)
        sums += [terms.sum(axis=(0, 1)), 2 * terms[:, ::2].sum(axis=(0, 1))]
        light = np.abs(bright).max(axis=0) * outer.distance
    edges = float(light @ (inner.error + outer.error)) * 2 * math.pi / len(shadow)
    return sums[0], np.abs(sums[0] - sums[1]) + np.abs(sums[0] - sums[2]) + edges


def _brightness(rings: PhotonRings, order: int, places: Array) -> Array:
    end = kc.EquatorialPlane(order + 1, "plunging")
    rays = kc.trace_rays(rings.camera, places.reshape(-1, 2), "integrated", 1e-12, end=end, redshift=True)
    assert rays.redshift is not None
    return _law(rays.radius, rays.azimuth, rays.redshift).reshape(places.shape[:-1])


KINDS: dict[str, Kind] = {"photon rings": photon_ring_claims, "ring visibility": visibility_claims}
