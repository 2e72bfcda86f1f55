"""Made-up results of every class, of any size, for tests of what all results share."""

import math
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
from public import PUBLIC

import kerrcaustics as kc
from kerrcaustics.beams.ends import End
from kerrcaustics.films.film import FilmResult
from kerrcaustics.images.counts import CountMap
from kerrcaustics.light_curves.results import LightEvent, SourceEvent
from kerrcaustics.results.declared import LAYOUTS, stored
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.circles import CircleCurve

# Naming them loads the modules of all public names.
assert PUBLIC
KINDS = sorted({FilmResult, *LAYOUTS}, key=lambda kind: kind.__name__)
CAMERA = kc.Camera(0.5, 4.0, 1.0, (0.1, -0.2, 0.3))
VIEW = kc.pictures.View(4, 3, 1.0, up=(0.3, 0.2, 1.0))
GIVEN = {
    kc.Camera: CAMERA,
    Viewer: CAMERA,
    kc.Observer: kc.Observer(spin=0.5, inclination=1.0),
    End: kc.Sphere(7.5),
    kc.CelestialSphere: kc.CelestialSphere(),
    kc.Sphere: kc.Sphere(7.5),
    kc.EquatorialPlane: kc.EquatorialPlane(2, "static"),
    kc.pictures.View: VIEW,
    Raster: VIEW,
    kc.Screen: kc.Screen(4, 3, 24.0, centre=(1.0, -2.0), up=(0.3, 1.0)),
    Path: Path("folder/sweep.zarr"),
}
SIZES = {
    "axis": 3,
    "local_axis": 3,
    "channel": 3,
    "angle": 2,
    "pair": 2,
    "end_axis": 2,
    "sky_axis": 2,
    "place_axis": 2,
    "pixel_axis": 2,
}
WHOLE = {"crossing", "index", "turning_points", "parity", "crossings", "status", "counts", "expected", "before"}
TRUTHS = {"closed_form", "on_caustic", "certified", "followed"}


def example(kind, count, absent=False):
    """A made-up result, with so many points, curves and images; absent: what may be None is."""
    if kind in GIVEN:
        return GIVEN[kind]
    if kind in (CircleCurve, CountMap):
        # No curve is without points, no map without cells.
        count = max(count, 1)
    hints = get_type_hints(kind)
    return kind(
        **{name: value(name, hints[name], about.dims, count, absent) for name, about in stored(kind).items()},
        **{name: None for name in kind.__dataclass_fields__ if name not in stored(kind)},
    )


def value(name, hint, dims, count, absent):
    """A value of a type: arrays with NaN, -1 or False in the first place."""
    parts = get_args(hint)
    if type(None) in parts:
        return None if absent else value(name, parts[0], dims, count, absent)
    if hint is LightEvent:
        return example(SourceEvent, count, absent)
    if hint in LAYOUTS or hint in GIVEN:
        return example(hint, count, absent)
    if "ndarray" in str(hint) and not parts:
        # Bins have one edge more.
        return array(name, [SIZES.get(dim, count + (dim == "edge")) for dim in dims])
    if str(hint).startswith("dict"):
        return {parts[0](k): parts[1](k + 1) for k in range(count + 1)}
    if parts and str(hint).startswith(("tuple", "list")):
        many = count if parts[-1] is Ellipsis or str(hint).startswith("list") else len(parts)
        kinds = [part for part in parts if part is not Ellipsis]
        made = [value(name, kinds[i % len(kinds)], dims[1:], count + i, absent) for i in range(many)]
        return tuple(made) if str(hint).startswith("tuple") else made
    return {float: 0.1 + 0.2, int: 3, bool: True, str: "a word"}.get(hint, (0.1, 0.2, 0.3))


def array(name, shape):
    if name in WHOLE:
        return np.arange(-1, math.prod(shape) - 1).reshape(shape)
    if name in TRUTHS:
        return np.arange(math.prod(shape)).reshape(shape) % 2 == 1
    made = np.sqrt(np.arange(math.prod(shape)) + 1.0)
    made[: name != "longitude"] = np.nan
    return made.reshape(shape)
