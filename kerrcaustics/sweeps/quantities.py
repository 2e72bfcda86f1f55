"""Quantities that a sweep computes for one camera, each with its error, and their descriptions in the store."""

import math
from dataclasses import replace

import numpy as np

from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.curves.caustic import Caustic
from kerrcaustics.curves.caustic_search import caustics
from kerrcaustics.images.counts import count_map
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.results.declared import Quantity, quantities
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.sweeps.scene import Scene

Array = np.ndarray
Curves = list[Caustic | None]
"""Caustics of a sweep by order; None for one without a curve."""

MOST_CUSPS = 12
QUANTILES = (0.1, 0.5, 0.9)
_GOLDEN = math.pi * (3 - math.sqrt(5))


def dimensions(scene: Scene) -> dict[str, Array]:
    """The values along every further dimension."""
    rows = scene.map_rows
    theta = (np.arange(rows) + 0.5) * 180 / rows
    return {
        "order": np.arange(1, scene.orders + 1),
        "cusp": np.arange(MOST_CUSPS),
        "vertex": np.arange(scene.curve_points),
        "axis": np.arange(3),
        "index": np.arange(scene.orders),
        "theta": theta,
        "phi": (np.arange(2 * rows) + 0.5) * 180 / rows,
        "quantile": np.array(QUANTILES),
    }


def variables(scene: Scene) -> list[Quantity]:
    """All variables of a sweep, each quantity followed by its error."""
    return [variable for name in scene.compute for variable in _VARIABLES[name]]


def _with_error(about: Quantity) -> list[Quantity]:
    return [about, replace(about, name=f"{about.name}_error", text=f"error of {about.name}")]


def _of_caustics(*names: str) -> list[Quantity]:
    """Quantities of a caustic as the store has them: by order, angles in degrees."""
    declared = (quantities(Caustic)[name] for name in names)
    return [replace(each, dims=("order",), unit="degrees" if each.unit == "rad" else each.unit) for each in declared]


_GEOMETRY = ("theta_min", "theta_max", "phi_min", "phi_max", "theta_extent", "phi_extent", "circuits")

_VARIABLES: dict[str, list[Quantity]] = {
    "geometry": [
        *(one for about in _of_caustics(*_GEOMETRY) for one in _with_error(about)),
        Quantity("cusp_count", ("order",), "1", "cusps; -1 where they are not known", "int16"),
        Quantity("closed", ("order",), "1", "1 where the whole curve was found, 0 where not", "int8"),
        *_of_caustics("residual"),
    ],
    "cusps": [
        Quantity("cusp_theta", ("order", "cusp"), "degrees", "theta' of the cusps, in the order of the curve"),
        Quantity("cusp_phi", ("order", "cusp"), "degrees", "unwrapped phi' of the cusps"),
        Quantity("cusp_error", ("order", "cusp"), "degrees", "error of both"),
    ],
    "areas": [
        *_with_error(Quantity("caustic_area", ("order",), "steradian", "area inside the caustic, unwrapped")),
        *_with_error(
            Quantity(
                "critical_area", ("order",), "steradian", "solid angle inside the critical curve on the camera sky"
            )
        ),
    ],
    "curves": [
        Quantity("curve_theta", ("order", "vertex"), "degrees", "theta' of points of the caustic, padded with NaN"),
        Quantity("curve_phi", ("order", "vertex"), "degrees", "their unwrapped phi'"),
        Quantity("curve_sky", ("order", "vertex", "axis"), "1", "direction N of the critical curve's points"),
        Quantity("curve_error", ("order",), "degrees", "error of the points"),
    ],
    "counts": [
        Quantity("image_count", ("theta", "phi", "index"), "1", "images of a star", "int16"),
        Quantity("image_count_on_caustic", ("theta", "phi"), "1", "1 where a caustic runs through, 0: exact", "int8"),
    ],
    "magnification": [
        *_with_error(Quantity("escaping", (), "1", "part of the camera sky that shows the celestial sphere")),
        *_with_error(
            Quantity("magnification", ("quantile",), "1", "quantiles of the magnification over that part of the sky")
        ),
    ],
}


def computed(scene: Scene, spin: float, radius: float, inclination: float) -> dict[str, Array]:
    """All variables of a sweep for one camera; a ValueError gives the reason if there are none."""
    camera = Camera(spin, radius, math.radians(inclination), scene.velocity)
    values: dict[str, Array] = {}
    if {"geometry", "cusps", "areas", "curves"} & set(scene.compute):
        by_order = {caustic.order: caustic for caustic in caustics(camera, scene.orders)}
        curves = [by_order.get(order) for order in range(1, scene.orders + 1)]
        for name, compute in (("geometry", _geometry), ("cusps", _cusps), ("areas", _areas), ("curves", _curves)):
            if name in scene.compute:
                values |= compute(scene, curves)
    if "counts" in scene.compute:
        counts = count_map(camera, max_index=scene.orders - 1, rows=scene.map_rows)
        values |= {"image_count": counts.counts, "image_count_on_caustic": counts.on_caustic}
    if "magnification" in scene.compute:
        values |= _magnification(scene, camera)
    return values


def _geometry(scene: Scene, curves: Curves) -> dict[str, Array]:
    names = [variable.name for variable in _VARIABLES["geometry"]]
    rows = []
    for caustic in curves:
        row: dict[str, float] = dict.fromkeys(names, math.nan) | {"cusp_count": -1, "closed": 0}
        if caustic is not None:
            error = math.degrees(caustic.error)
            for name in _GEOMETRY[:-1]:
                row[name] = math.degrees(getattr(caustic, name))
                row[f"{name}_error"] = error * (2 if name.endswith("extent") else 1)
            resolved = caustic.kind != "unresolved"
            row |= {
                "circuits": caustic.circuits,
                "circuits_error": 2 * error / 360,
                "cusp_count": len(caustic.cusps) if resolved else -1,
                "closed": caustic.closed,
                "residual": caustic.residual,
            }
        rows.append(row)
    return {name: np.array([row[name] for row in rows]) for name in names}


def _cusps(scene: Scene, curves: Curves) -> dict[str, Array]:
    values = np.full((3, scene.orders, MOST_CUSPS), np.nan)
    for i, caustic in enumerate(curves):
        for j, cusp in enumerate(caustic.cusps[:MOST_CUSPS] if caustic else ()):
            values[:, i, j] = np.degrees([*cusp.celestial, cusp.error])
    return dict(zip(("cusp_theta", "cusp_phi", "cusp_error"), values, strict=True))


def _areas(scene: Scene, curves: Curves) -> dict[str, Array]:
    values = np.full((4, scene.orders), np.nan)
    for i, caustic in enumerate(curves):
        if caustic is None or not caustic.closed:
            continue
        whole, half = _loop_areas(caustic.sky, caustic.celestial), _loop_areas(caustic.sky[::2], caustic.celestial[::2])
        # Half the points have sixteen times the error.
        values[:, i] = whole[0], abs(whole[0] - half[0]), whole[1], abs(whole[1] - half[1])
    return {
        "caustic_area": values[0],
        "caustic_area_error": values[1] + np.array([caustic_error(c) for c in curves]),
        "critical_area": values[2],
        "critical_area_error": values[3],
    }


def caustic_error(caustic: Caustic | None) -> float:
    """Error of a caustic's area, steradian, that comes from the error of its points."""
    if caustic is None:
        return math.nan
    return 2 * caustic.error * (caustic.theta_extent + caustic.phi_extent) + caustic.error**2


def _loop_areas(sky: Float[Array, "n 3"], celestial: Float[Array, "n 2"]) -> tuple[float, float]:
    """Areas (steradian) inside a caustic, theta' and unwrapped phi' (n, 2), and inside its critical curve (n, 3).

    Both are smooth in the arc of the critical curve, at the cusps too: integrals along splines.
    """
    points = np.hstack([sky, celestial])
    points = np.vstack([points, points[:1]])
    arc = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)))
    distinct = np.append(True, np.diff(arc) > 0)
    arc, points = arc[distinct], points[distinct]
    points[-1] = points[0]
    spline = Spline(arc, points, periodic=True)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    step = np.diff(arc)[:, None]
    places = arc[:-1, None] + step * (1 + nodes) / 2
    at, slope, weight = spline(places.ravel()), spline(places.ravel(), 1), (step * weights / 2).ravel()
    caustic = abs(float(-(np.cos(at[:, 3]) * slope[:, 4]) @ weight))
    turning = np.cross(at[:, :3], slope[:, :3])
    middle = weight @ turning
    middle /= np.linalg.norm(middle)
    length = np.linalg.norm(at[:, :3], axis=1)
    # (1 - cos alpha) d beta in polar coordinates about the middle.
    solid = float((turning @ middle / (length * (length + at[:, :3] @ middle))) @ weight)
    return caustic, abs(solid)


def _curves(scene: Scene, curves: Curves) -> dict[str, Array]:
    count = scene.curve_points
    celestial, sky = np.full((scene.orders, count, 2), np.nan), np.full((scene.orders, count, 3), np.nan)
    error = np.full(scene.orders, np.nan)
    for i, caustic in enumerate(curves):
        if caustic is not None:
            length = min(count, len(caustic.sky))
            points = np.arange(length) * len(caustic.sky) // length
            celestial[i, :length], sky[i, :length] = np.degrees(caustic.celestial[points]), caustic.sky[points]
            error[i] = math.degrees(caustic.error)
    return {"curve_theta": celestial[..., 0], "curve_phi": celestial[..., 1], "curve_sky": sky, "curve_error": error}


def _magnification(scene: Scene, camera: Camera) -> dict[str, Array]:
    """Statistics over directions spread evenly on the sky; the error from the four quarters of them."""
    number = np.arange(scene.directions)
    z = 1 - (2 * number + 1) / scene.directions
    across = np.sqrt(1 - z**2)
    sky = np.stack([across * np.cos(_GOLDEN * number), across * np.sin(_GOLDEN * number), z], axis=-1)
    beams = beams_of_directions(camera, sky, "auto", crossings=False, redshift=False)
    parts = []
    for part in (slice(None), *(slice(first, None, 4) for first in range(4))):
        escaped = np.asarray(beams.escaped)[part]
        bright = np.asarray(beams.magnification)[part][escaped]
        quantiles = np.quantile(bright, QUANTILES) if len(bright) else np.full(len(QUANTILES), np.nan)
        parts.append(np.append(quantiles, escaped.mean()))
    whole, quarters = parts[0], np.array(parts[1:])
    # Of the mean of four; a factor of 2 since the scatter of four values is uncertain.
    error = 2 * np.std(quarters, axis=0, ddof=1) / 2
    return {
        "escaping": whole[-1],
        "escaping_error": error[-1],
        "magnification": whole[:-1],
        "magnification_error": error[:-1],
    }
