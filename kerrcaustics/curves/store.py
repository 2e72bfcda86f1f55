"""Caustics as files and records: one .npz file that loads back equal, a JSON record, an xarray Dataset."""

import json
import math
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from kerrcaustics.curves.caustic import Caustic, CausticSet, Cusp
from kerrcaustics.files import writing
from kerrcaustics.spacetime.camera import Camera

if TYPE_CHECKING:
    import xarray

FILE_SCHEMA = "kerrcaustics/caustics-file/1"
RECORD_SCHEMA = "kerrcaustics/caustics/1"

_MADE = ("engine", "tolerance", "seconds", "beams", "versions", "missing")
_CURVE = (
    "order",
    "theta_min",
    "theta_max",
    "phi_min",
    "phi_max",
    "kind",
    "closed",
    "error",
    "residual",
    "remarks",
)
_CAMERA = ("spin", "radius", "inclination", "velocity")


def save_caustics(path: str | os.PathLike[str], caustics: CausticSet) -> None:
    """Write a caustic set to one file: NumPy .npz with a JSON header. Nothing is left half-written.

    Parameters
    ----------
    path : str or path
        The file gets the name as it is given: no ending is added.
    caustics : CausticSet
        What `caustics` returned.
    """
    if not isinstance(caustics, CausticSet):
        raise ValueError(f"Argument `caustics` must be a CausticSet, but is {type(caustics).__name__}.")
    head = {
        "schema": FILE_SCHEMA,
        "camera": {name: getattr(caustics.camera, name) for name in _CAMERA},
        **{name: getattr(caustics, name) for name in _MADE},
        "curves": [{name: getattr(curve, name) for name in _CURVE} for curve in caustics],
    }
    arrays = {"head": np.array(json.dumps(head))}
    for i, curve in enumerate(caustics):
        arrays[f"sky_{i}"], arrays[f"celestial_{i}"] = curve.sky, curve.celestial
        arrays[f"cusp_sky_{i}"] = np.array([c.sky for c in curve.cusps]).reshape(-1, 3)
        arrays[f"cusp_celestial_{i}"] = np.array([c.celestial for c in curve.cusps]).reshape(-1, 2)
        arrays[f"cusp_error_{i}"] = np.array([c.error for c in curve.cusps])
    with writing(path) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def load_caustics(path: str | os.PathLike[str]) -> CausticSet:
    """The CausticSet that `save_caustics` wrote to `path`, equal to the one that was saved."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = dict(stored)
        head = json.loads(str(arrays["head"]))
        if head["schema"] == FILE_SCHEMA:
            return _loaded(head, arrays)
    except OSError as error:
        reason = error.strerror or "it is no such file"
        raise ValueError(f"Argument `path` must name a file that can be read: {os.fspath(path)!r}: {reason}.") from None
    except Exception as error:
        raise ValueError(f"Argument `path` must name a caustics file, but {os.fspath(path)!r} is not one.") from error
    raise ValueError(f"Argument `path` must name a file of schema {FILE_SCHEMA}, but this one is {head['schema']}.")


def _loaded(head: dict[str, Any], arrays: dict[str, np.ndarray]) -> CausticSet:
    place = head["camera"]
    camera = Camera(place["spin"], place["radius"], place["inclination"], _velocity(place["velocity"]))
    curves = [_curve(i, entry, arrays) for i, entry in enumerate(head["curves"])]
    made = {name: head[name] for name in _MADE}
    made["missing"] = tuple(made["missing"])
    return CausticSet(curves, camera=camera, **made)


def _velocity(value: str | list[float]) -> str | tuple[float, float, float]:
    return value if isinstance(value, str) else (value[0], value[1], value[2])


def _curve(i: int, entry: dict[str, Any], arrays: dict[str, np.ndarray]) -> Caustic:
    columns = (arrays[f"cusp_{name}_{i}"] for name in ("sky", "celestial", "error"))
    cusps = tuple(Cusp(sky, celestial, float(error)) for sky, celestial, error in zip(*columns, strict=True))
    return Caustic(
        sky=arrays[f"sky_{i}"],
        celestial=arrays[f"celestial_{i}"],
        cusps=cusps,
        **{**entry, "remarks": tuple(entry["remarks"])},
    )


def camera_record(camera: Camera) -> dict[str, Any]:
    """The camera's part of every JSON record."""
    return {
        "spin": camera.spin,
        "radius": camera.radius,
        # Fifteen digits, so that 60 degrees in is 60 degrees out.
        "inclination_deg": degrees(camera.inclination),
        "velocity": camera.velocity,
    }


def degrees(angle: float) -> float:
    """An angle the user gave in degrees, in degrees again."""
    return float(f"{math.degrees(angle):.15g}")


def record(caustics: CausticSet, points: bool = False) -> dict[str, Any]:
    """The caustics as a JSON-ready record of schema "kerrcaustics/caustics/1": angles in degrees.

    With points, every curve carries its points too.
    """
    return {
        "schema": RECORD_SCHEMA,
        **camera_record(caustics.camera),
        "engine": caustics.engine,
        "tolerance_rad": caustics.tolerance,
        "seconds": caustics.seconds,
        "beams": caustics.beams,
        "versions": caustics.versions,
        "missing_orders": list(caustics.missing),
        "curves": [_curve_record(curve, points) for curve in caustics],
    }


def _curve_record(curve: Caustic, points: bool) -> dict[str, Any]:
    entry = {
        "order": curve.order,
        **{
            f"{name}_deg": math.degrees(getattr(curve, name))
            for name in ("theta_min", "theta_max", "theta_extent", "phi_min", "phi_max", "phi_extent")
        },
        "circuits": curve.circuits,
        "kind": curve.kind,
        "closed": curve.closed,
        "error_deg": math.degrees(curve.error),
        "residual": curve.residual,
        "remarks": list(curve.remarks),
        "cusps": [
            {
                "theta_deg": math.degrees(cusp.celestial[0]),
                "phi_deg": math.degrees(cusp.celestial[1]),
                "error_deg": math.degrees(cusp.error),
                "sky": cusp.sky.tolist(),
            }
            for cusp in curve.cusps
        ],
    }
    if points:
        entry["sky"] = curve.sky.tolist()
        entry["celestial_deg"] = np.degrees(curve.celestial).tolist()
    return entry


def to_xarray(caustics: CausticSet) -> "xarray.Dataset":
    """The numbers of the caustics as an xarray Dataset over (order, point, cusp), padded with NaN; angles in radians.

    Units are in the attributes of each variable; remarks and what is missing, in words, are not carried over.
    """
    import xarray

    longest = max((len(curve.sky) for curve in caustics), default=0)
    most_cusps = max((len(curve.cusps) for curve in caustics), default=0)
    data: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {
        "sky": (
            ("order", "point", "axis"),
            _stacked([c.sky for c in caustics], longest, 3),
            {"long_name": "direction N"},
        ),
        "celestial": (
            ("order", "point", "angle"),
            _stacked([c.celestial for c in caustics], longest, 2),
            {"units": "rad", "long_name": "theta', unwrapped phi'"},
        ),
        "cusp": (
            ("order", "cusp_number", "angle"),
            _stacked([np.array([k.celestial for k in c.cusps]).reshape(-1, 2) for c in caustics], most_cusps, 2),
            {"units": "rad", "long_name": "cusps"},
        ),
    }
    for name in ("theta_min", "theta_max", "phi_min", "phi_max", "theta_extent", "phi_extent", "error"):
        data[name] = (("order",), [getattr(c, name) for c in caustics], {"units": "rad"})
    for name in ("circuits", "residual", "closed", "kind"):
        data[name] = (("order",), [getattr(c, name) for c in caustics], {})
    camera = caustics.camera
    attributes = {name: getattr(camera, name) for name in _CAMERA}
    attributes |= {"engine": caustics.engine, "tolerance": caustics.tolerance}
    attributes |= {f"version_{name}": version for name, version in caustics.versions.items()}
    coordinates = {"order": [c.order for c in caustics], "axis": list("xyz"), "angle": ["theta", "phi"]}
    return xarray.Dataset(data, coords=coordinates, attrs=attributes)


def _stacked(curves: list[np.ndarray], length: int, width: int) -> np.ndarray:
    """Arrays (n, width) of different n as one array (curve, length, width), padded with NaN."""
    stacked = np.full((len(curves), length, width), np.nan)
    for filled, values in zip(stacked, curves, strict=True):
        filled[: len(values)] = values
    return stacked
