"""The parity table: every public analysis by surface and by viewer, what is refused for a reason, and what is missing.

A cell of the table is an analysis, a surface and a viewer. It holds an answer of the one class of its analysis, all of
whose fields are there; or a refusal, which stands in REFUSED with its physical reason; or a gap, which stands in GAPS.
"""

import math
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from inspect import signature
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.ends import End
from kerrcaustics.results.declared import LAYOUTS, element, stored
from kerrcaustics.spacetime.viewer import Viewer

INCLINATION = 1.2
SURFACES = ("sky", "beyond", "within", "plane")
VIEWERS: dict[str, Callable[[float], Viewer]] = {
    "near": lambda inclination: kc.Camera(0.9, 10.0, inclination, (0.0, 0.0, 0.3)),
    "far": lambda inclination: kc.Camera(0.9, 1e6, inclination, (0.0, 0.0, 1e-3)),
    "finite": lambda inclination: kc.Observer(spin=0.9, inclination=inclination, radius=1e3),
    "infinity": lambda inclination: kc.Observer(spin=0.9, inclination=inclination),
}
# A camera in the plane: only the surface "plane" has a column of it.
EQUATORIAL = "equatorial"
OBSERVERS, OFF_PLANE, ALL = ("finite", "infinity"), tuple(VIEWERS), (*VIEWERS, EQUATORIAL)
SPHERES, FINITE = ("sky", "beyond", "within"), ("beyond", "within", "plane")


class Cell(NamedTuple):
    """A place in the table."""

    analysis: str
    surface: str
    viewer: str

    def __str__(self) -> str:
        """The id of its test."""
        return "-".join(self)


def viewer_named(name: str, inclination: float = INCLINATION) -> Viewer:
    return kc.Camera(0.9, 10.0) if name == EQUATORIAL else VIEWERS[name](inclination)


def end_for(surface: str, viewer: str) -> float | kc.EquatorialPlane:
    if surface == "plane":
        return kc.EquatorialPlane(2)
    if surface == "within":
        return 7.0
    return 2 * viewer_named(viewer).radius if surface == "beyond" else math.inf


def directions(viewer: str) -> np.ndarray:
    """A few directions outside the shadow: of an observer (4, 2), else (4, 3)."""
    edge = kc.shadow_edge(viewer_named(viewer), 4)
    if edge.shape[1] == 2:
        return 1.05 * edge
    hole = edge.mean(axis=0)
    return hole + 1.05 * (edge - hole)


def place_on(surface: str) -> tuple[float, float]:
    return (8.0, 2.9) if surface == "plane" else (1.4, 2.9)


def level_on(surface: str, viewer: str) -> float:
    """The circle of a source: theta, through a caustic where tracks along that are quick; a radius in the plane."""
    if surface == "plane":
        return 8.0
    return math.pi - INCLINATION if viewer == "near" or surface == "within" else 1.4


def where(cell: Cell) -> dict[str, Any]:
    """The argument `end`, which the sky does not need."""
    return {} if cell.surface == "sky" else {"end": end_for(cell.surface, cell.viewer)}


def own_plane(cell: Cell) -> dict[str, Any]:
    """No argument: of analyses whose only surface is the plane."""
    return {} if cell.surface == "plane" else where(cell)


@cache
def star_images(surface: str, viewer: str) -> Any:
    cell = Cell("star_images", surface, viewer)
    return kc.star_images(viewer_named(viewer), place_on(surface), 1, **where(cell))


@cache
def circle_images(surface: str, viewer: str) -> Any:
    return kc.circle_images(viewer_named(viewer), (0.3, 0.0), 1, **where(Cell("circle_images", surface, viewer)))


def count_map(cell: Cell) -> Any:
    radii = {"radii": [6.0, 9.0]} if cell.surface == "plane" else {}
    return kc.count_map(viewer_named(cell.viewer), 1, 4, **radii, **where(cell))


def magnification(cell: Cell) -> Any:
    """Of a disc of a hundredth of a radian; at a finite radius its size is a length."""
    viewer = viewer_named(cell.viewer)
    size = 0.01 * (2.0 * viewer.radius if cell.surface == "beyond" and math.isfinite(viewer.radius) else 1.0)
    return kc.magnification(viewer, place_on(cell.surface), size, max_index=1, **where(cell))


def amplification(cell: Cell) -> Any:
    return kc.amplification(viewer_named(cell.viewer), place_on(cell.surface), [5.0], max_index=1, **where(cell))


def follow_star(cell: Cell) -> Any:
    cameras = [viewer_named(cell.viewer, INCLINATION + step) for step in (0.0, 0.01)]
    return kc.follow_star(cameras, place_on(cell.surface), 1, **where(cell))


def sight(name: str) -> tuple[Viewer, Any]:
    """A viewer, and a small picture of about 30 M toward the hole."""
    viewer = viewer_named(name)
    if name in OBSERVERS:
        return viewer, kc.Screen(16, 9, 30.0)
    return viewer, kc.pictures.View.toward_hole(viewer, 16, 9, 2 * math.atan(15 / viewer.radius))


def picture(cell: Cell) -> Any:
    """Of the sky through a disk that lets all of it pass, or of a disk before the sky."""
    opacity = 0.0 if cell.surface == "sky" else 1.0
    disk = kc.disks.Disk(6.0, 9.0, kc.disks.BlackBody(6500.0), opacity=opacity)
    return kc.render(*sight(cell.viewer), kc.skies.Checkerboard(), disk=disk, delay=True)


def volume_picture(cell: Cell) -> Any:
    """Of a volume on one side of the viewer, or of nothing but the sky."""
    inner, outer = 5.0, 8.0
    if cell.surface == "beyond":
        inner, outer = (part * viewer_named(cell.viewer).radius for part in (1.5, 2.0))
    volume = kc.disks.Volume(0.0 if cell.surface == "sky" else 0.01, 6500.0, inner=inner, outer=outer)
    return kc.pictures.render_volume(*sight(cell.viewer), volume, kc.skies.Checkerboard())


CONSTANTS = {"constants": True, "emission": True}
CALLS: dict[str, Callable[[Cell], Any]] = {
    "caustics": lambda c: kc.caustics(viewer_named(c.viewer), 2, **where(c)),
    "star_images": lambda c: star_images(c.surface, c.viewer),
    "image_counts": lambda c: kc.image_counts(viewer_named(c.viewer), [place_on(c.surface)], 1, **where(c)),
    "count_map": count_map,
    "pair_events": lambda c: kc.pair_events(viewer_named(c.viewer), level_on(c.surface, c.viewer), 1, **where(c)),
    "star_tracks": lambda c: kc.star_tracks(viewer_named(c.viewer), level_on(c.surface, c.viewer), 1, **where(c)),
    "circle_images": lambda c: circle_images(c.surface, c.viewer),
    "magnification": magnification,
    "amplification": amplification,
    "crossings_of_line": lambda c: kc.crossings_of_line(circle_images(c.surface, c.viewer), 0.5),
    "follow_star": follow_star,
    "image_derivatives": lambda c: kc.image_derivatives(viewer_named(c.viewer), star_images(c.surface, c.viewer)),
    "event_derivatives": lambda c: kc.event_derivatives(viewer_named(c.viewer), CALLS["pair_events"](c)),
    "caustic_derivatives": lambda c: kc.caustic_derivatives(viewer_named(c.viewer), 2, **where(c)),
    "caustic_tubes": lambda c: kc.caustic_tubes(viewer_named(c.viewer), 1, np.array([math.inf, 20.0, 6.0]), **where(c)),
    "ray_paths": lambda c: kc.ray_paths(viewer_named(c.viewer), directions(c.viewer), 12, beams=True, **where(c)),
    "trace_rays": lambda c: kc.trace_rays(
        viewer_named(c.viewer), directions(c.viewer), time=True, redshift=True, **CONSTANTS, **where(c)
    ),
    "trace_beams": lambda c: kc.trace_beams(
        viewer_named(c.viewer), directions(c.viewer), time=True, **CONSTANTS, **where(c)
    ),
    "isoradials": lambda c: kc.isoradials(viewer_named(c.viewer), [9.0], 1, 60, **own_plane(c)),
    "photon_rings": lambda c: kc.photon_rings(viewer_named(c.viewer), max_order=1, outer=9.0, **own_plane(c)),
    "light_curve": lambda c: kc.light_curve(
        viewer_named(c.viewer), 9.0, 8, source=kc.Spot(crossings=1, points=60), **own_plane(c)
    ),
    "line_profile": lambda c: kc.line_profile(viewer_named(c.viewer), 7.0, 9.0, radii=4, turns=16, **own_plane(c)),
    "shadow_edge": lambda c: kc.shadow_edge(viewer_named(c.viewer), 8, **where(c)),
    "render": picture,
    "render_volume": volume_picture,
}

# Analyses of what another one returns: the surface is that of the other one.
OF_RESULTS = {
    "crossings_of_line": "circle_images",
    "image_derivatives": "star_images",
    "event_derivatives": "pair_events",
}
# Fields that are None unless they are asked for; every call here asks for them.
ASKED = {"time", "time_error", "redshift", "index", "index_certain", "crossings", "crossings_certain"}
ASKED |= {"impact", "impact_error", "carter", "carter_error", "emission_cosine", "emission_error"}
ASKED |= {"visible_fraction", "transmission", "beams"}
ASKED_OF = ("trace_rays", "trace_beams", "ray_paths", "isoradials", "render")


class Refusal(NamedTuple):
    """Cells without an answer, for a reason that is none of the program's.

    argument: which one the ValueError names; None where no argument can say what the cell means.
    """

    analyses: tuple[str, ...]
    surfaces: tuple[str, ...]
    viewers: tuple[str, ...]
    argument: str | None
    reason: str


class Gap(NamedTuple):
    """Cells without an answer, or with one of another kind, for no reason in physics; what: as `gap_of` says it."""

    analyses: tuple[str, ...]
    surfaces: tuple[str, ...]
    viewers: tuple[str, ...]
    what: str


EVERY = tuple(CALLS)
OF_SOURCES = ("caustics", "star_images", "image_counts", "count_map", "pair_events", "star_tracks")
DISKS = ("isoradials", "photon_rings", "light_curve", "line_profile")
PICTURES = ("render", "render_volume")
# Analyses whose surface is no argument `end`.
OF_MATTER = (*DISKS, *PICTURES)
IN_PLANE = "from within the plane every crossing is a conjugate point of the rays along it: no source has an image"
REFUSED = (
    Refusal(EVERY, ("beyond",), ("infinity",), None, "nothing lies beyond an observer at infinity"),
    Refusal(("circle_images", "crossings_of_line"), ("plane",), ALL, "end", "great circles are circles of a sphere"),
    Refusal(("amplification",), ("plane",), ALL, "end", "waves of a source arrive by all crossings together"),
    Refusal(
        ("circle_images", "crossings_of_line"),
        ("within",),
        OFF_PLANE,
        "end",
        "the camera circles as the source sees it only if the source circles about the spin axis",
    ),
    Refusal(("shadow_edge",), FINITE, ALL, "end", "light of the shadow's edge winds onto photon orbits for ever"),
    Refusal(("caustic_tubes",), FINITE, ALL, "end", "tubes are surfaces in space; their sections are caustics"),
    Refusal(DISKS, SPHERES, OFF_PLANE, "end", "disks, and circular orbits of spots, lie in the equatorial plane"),
    Refusal(
        ("caustics", "star_images", "image_counts", "count_map", "pair_events", "star_tracks"),
        ("plane",),
        (EQUATORIAL,),
        "camera",
        IN_PLANE,
    ),
    Refusal(
        (
            "line_profile",
            "light_curve",
            "image_derivatives",
            "event_derivatives",
            "caustic_derivatives",
        ),
        ("plane",),
        (EQUATORIAL,),
        "camera",
        IN_PLANE,
    ),
    Refusal(("magnification",), ("plane",), (EQUATORIAL,), "viewer", IN_PLANE),
    Refusal(("follow_star",), ("plane",), (EQUATORIAL,), "cameras", IN_PLANE),
    Refusal(
        ("render",), ("within", "beyond"), OFF_PLANE, None, "matter beside the plane is a volume, of render_volume"
    ),
    Refusal(
        ("render_volume",), ("plane",), ALL, None, "a plane has no depth along a ray: matter in it is a disk, of render"
    ),
)
GAPS: tuple[Gap, ...] = ()


def cells() -> list[Cell]:
    """The whole table, in an order in which critical curves serve many cells in a row."""
    columns = [(viewer, surface) for viewer in VIEWERS for surface in SURFACES] + [(EQUATORIAL, "plane")]
    return [Cell(analysis, surface, viewer) for viewer, surface in columns for analysis in CALLS]


def holds(entry: Refusal | Gap, cell: Cell) -> bool:
    return cell.analysis in entry.analyses and cell.surface in entry.surfaces and cell.viewer in entry.viewers


def refusal_of(cell: Cell) -> Refusal | None:
    return next((entry for entry in REFUSED if holds(entry, cell)), None)


def gaps_of(cell: Cell) -> tuple[str, ...]:
    return () if refusal_of(cell) else tuple(entry.what for entry in GAPS if holds(entry, cell))


def function_of(analysis: str) -> Callable[..., Any]:
    """The public function, at the top or among the pictures."""
    return getattr(kc, analysis, None) or getattr(kc.pictures, analysis)


def takes_end(analysis: str) -> bool:
    """True if the signature has `end`: that of the function which takes the viewer."""
    return "end" in signature(function_of(OF_RESULTS.get(analysis, analysis))).parameters


def classes_of(analysis: str) -> tuple[type, ...]:
    """The classes that the return annotation names; of a tuple, those in it."""
    hint = get_type_hints(function_of(analysis))["return"]
    options = get_args(hint) if type(None) not in get_args(hint) and get_origin(hint) is not tuple else (hint,)
    return tuple(get_args(option)[0] if get_origin(option) is tuple else option for option in options or (hint,))


def class_of(analysis: str) -> type:
    """The one class of an analysis: that which GAPS does not name."""
    others = {entry.what.removeprefix("class ") for entry in GAPS if analysis in entry.analyses}
    (only,) = (kind for kind in classes_of(analysis) if kind.__name__ not in others)
    return only


def optional_fields(kind: type) -> set[str]:
    """Names of the fields that may be None, of a result and of the results in it."""
    if kind not in LAYOUTS or issubclass(kind, Viewer | End):
        return set()
    hints = get_type_hints(kind)
    found = {name for name in stored(kind) if type(None) in get_args(hints[name])}
    return found.union(*(optional_fields(inner) for name in stored(kind) if (inner := element(kind, name)[0])))


def absent(value: Any) -> set[str]:
    """Names of the fields that are None, of a result and of the results in it."""
    if isinstance(value, tuple | list):
        return set().union(*map(absent, value))
    if not is_dataclass(value) or isinstance(value, Viewer | End):
        return set()
    held = {field.name: getattr(value, field.name) for field in fields(value) if not field.name.startswith("_")}
    return {name for name, part in held.items() if part is None}.union(*map(absent, held.values()))


def refused_argument(error: ValueError) -> str:
    named = re.match(r"Argument `(\w+)` must ", str(error))
    assert named, f"the message does not begin with an argument: {error}"
    return named[1]


@cache
def answer_of(cell: Cell) -> Any:
    return CALLS[cell.analysis](cell)


def gap_of(cell: Cell) -> str | None:
    """The gap of a cell; None for an answer of the right class with all fields."""
    if cell.surface != "sky" and cell.analysis not in OF_MATTER and not takes_end(cell.analysis):
        return "no `end`"
    try:
        answer = answer_of(cell)
    except ValueError as error:
        return f"refuses `{refused_argument(error)}`"
    parts = answer if type(answer) is tuple else (answer,)
    if other := {type(part).__name__ for part in parts} - {class_of(cell.analysis).__name__}:
        return f"class {', '.join(sorted(other))}"
    missing = absent(parts)
    return f"None: {', '.join(sorted(missing))}" if missing else None
