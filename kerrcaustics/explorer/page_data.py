"""The data of a state for the page: arrays of float32, and the numbers with their errors and certificate."""

import json
import math
import struct
import time
from collections import OrderedDict
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np

from kerrcaustics.beams.ends import SKY
from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.curves.caustic_search import caustics
from kerrcaustics.curves.critical_points import Points, Search
from kerrcaustics.explorer.limits import allowed
from kerrcaustics.explorer.state import ExplorerState
from kerrcaustics.images.images import StarImages, images_of
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import Sheets, sheets_of
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.results.stages import stage
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge
from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

# Points of the shadow's edge; lines across the sky that find coarse curves, half of them where those are mirrored.
_EDGE, _COARSE_LINES = 240, 48
# Most points of a curve that the page is given: it cannot show more.
_MOST_POINTS = 3000
_COARSE_TOLERANCE = 1e-8
_MAGIC = b"KCX1"
# Events whose curves and sheets are kept, some MB each: more than the few that sit at one machine.
_EVENTS = 24
_Event = tuple[Camera, int]

QUALITIES = ("full", "draft", "star")


@dataclass(frozen=True, eq=False)
class Message:
    """A message to the page: a record, and arrays of float32 or bytes by name."""

    record: dict[str, Any]
    arrays: dict[str, Array]

    def encoded(self) -> bytes:
        """The message: "KCX1", the length of the JSON, the JSON, zeros up to a multiple of 4, the arrays one by one.

        The JSON has under "arrays" the name, place (bytes after the JSON and its zeros), type and shape of each.
        """
        parts, places, offset = [], {}, 0
        for name, array in self.arrays.items():
            kind = "u1" if array.dtype == np.uint8 else "f4"
            data = np.ascontiguousarray(array, kind).tobytes()
            data += bytes(-len(data) % 4)
            places[name] = {"offset": offset, "type": kind, "shape": list(array.shape)}
            parts.append(data)
            offset += len(data)
        head = json.dumps({**self.record, "arrays": places}, allow_nan=False).encode()
        head += b" " * (-len(head) % 4)
        return b"".join([_MAGIC, struct.pack("<I", len(head)), head, *parts])


@usual_warnings
def view_of(state: ExplorerState, quality: str = "full") -> Message:
    """Curves, caustics and images of a state.

    Parameters
    ----------
    state : ExplorerState
    quality : str
        "full"; "draft", while a slider moves: coarse curves and no images, where the whole is not known already; or
        "star", while the star moves: the images alone, in full.

    Returns
    -------
    Message
        Its record says in "quality" which of them it is. Places are rounded to float32, numbers are not.

    Errors
    ------
    Those of `caustics` and `star_images`, given with each number. Points of coarse curves are few, but lie on the
    curves to 1e-8 rad.
    """
    began = time.perf_counter()
    if quality not in QUALITIES:
        raise ValueError(f"Argument `quality` must be one of {', '.join(QUALITIES)}, but is {quality!r:.40}.")
    state.check()
    camera = state.camera()
    event = camera, state.orders
    if quality == "draft" and event in _kept:
        quality = "full"
    record: dict[str, Any] = {"kind": "view", "state": state.record(), "quality": quality}
    record |= {"address": state.address(), "commands": state.commands(), "python": state.python()}
    record |= {"has_orbit": state.has_orbit, "allowed": allowed(state)}
    arrays: dict[str, Array] = {}
    if quality != "star":
        arrays["edge"] = shadow_edge(camera, _EDGE)
        record["axes"] = shadow_axes(camera, arrays["edge"]).tolist()
        record["motion"] = _motion(camera)
    if quality == "draft":
        with stage("coarse_curves"):
            _add_coarse(record, arrays, camera, state.orders)
    else:
        curves, sheets = _kept.entry(event)
        if quality == "full":
            _add_caustics(record, arrays, curves)
        star = state.star()
        with stage("images_of_the_star"):
            images = images_of(camera, SKY, [star], search(sheets, from_angles(*star)[None]))[0]
        record["images"], arrays["images"] = _numbers_of_images(images), images.sky
    record["seconds"] = time.perf_counter() - began
    return Message(record, arrays)


def curves_of(state: ExplorerState) -> CausticSet:
    """The caustics of a state's camera, kept for the next."""
    return _kept.entry((state.camera(), state.orders))[0]


def _motion(camera: Camera) -> list[float] | None:
    """Direction N in which a camera moves past the fiducial observer, None at rest (JTFT A.1: e_y = B)."""
    speed = camera.fido_velocity()[2]
    return [0.0, math.copysign(1.0, speed), 0.0] if speed else None


class _Kept:
    """Caustics and sheets of the last few events: what they hold does not change."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = Lock()
        self._entries: OrderedDict[_Event, tuple[CausticSet, Sheets]] = OrderedDict()

    def __contains__(self, event: _Event) -> bool:
        return event in self._entries

    def entry(self, event: _Event) -> tuple[CausticSet, Sheets]:
        """Caustics and sheets of an event, computed unless they are kept."""
        with self._lock:
            if event in self._entries:
                self._entries.move_to_end(event)
                return self._entries[event]
        camera, orders = event
        with stage("critical_curves_and_caustics"):
            curves = caustics(camera, orders)
        with stage("sky_between_the_curves"):
            entry = curves, sheets_of(camera, orders - 1)
        with self._lock:
            self._entries[event] = entry
            while len(self._entries) > self._most:
                self._entries.popitem(last=False)
        return entry


_kept = _Kept(_EVENTS)


def _add_caustics(record: dict[str, Any], arrays: dict[str, Array], curves: CausticSet) -> None:
    record["caustics"] = [_numbers(caustic) for caustic in curves]
    record["missing_orders"] = list(curves.missing)
    for caustic in curves:
        step = -(-len(caustic.sky) // _MOST_POINTS)
        arrays[f"critical{caustic.order}"] = caustic.sky[::step]
        arrays[f"caustic{caustic.order}"] = np.degrees(caustic.celestial[::step])


def _numbers(caustic: Caustic) -> dict[str, Any]:
    """The numbers of a caustic, degrees."""
    names = ("theta_min", "theta_max", "phi_min", "phi_max", "theta_extent", "phi_extent")
    cusps = [
        {"sky": cusp.sky.tolist(), "celestial": np.degrees(cusp.celestial).tolist(), "error": math.degrees(cusp.error)}
        for cusp in caustic.cusps
    ]
    return {
        "order": caustic.order,
        "kind": caustic.kind,
        "closed": caustic.closed,
        "circuits": caustic.circuits,
        "error": math.degrees(caustic.error),
        "residual": caustic.residual,
        "cusps": cusps,
        "remarks": list(caustic.remarks),
        **{name: math.degrees(getattr(caustic, name)) for name in names},
    }


def _numbers_of_images(images: StarImages) -> dict[str, Any]:
    """The numbers of images: lists with one entry an image, and the certificate."""
    return {
        "index": images.index.tolist(),
        "parity": images.parity.tolist(),
        "magnification": finite(images.magnification),
        "redshift": finite(images.redshift),
        "azimuth": finite(np.degrees(images.azimuth)),
        "error": finite(np.degrees(images.error)),
        "sky": images.sky.tolist(),
        "per_index": list(images.per_index.values()),
        "expected": list(images.expected.values()),
        "on_caustic": list(images.on_caustic),
        "certified": images.certified,
        "remarks": list(images.remarks),
    }


def finite(values: Array) -> list[float | None]:
    """Numbers as JSON has them: None for those that are not finite."""
    return [float(value) if math.isfinite(value) else None for value in np.asarray(values, float)]


def _add_coarse(record: dict[str, Any], arrays: dict[str, Array], camera: Camera, orders: int) -> None:
    """Critical curves by few points, which lie on them, and their images."""
    search = Search(SearchMap(camera.at_rest(), tolerance=_COARSE_TOLERANCE))
    half = search.camera.on_equator
    line = np.linspace(0, np.pi, _COARSE_LINES // 2 + 1) if half else np.linspace(0, 2 * np.pi, _COARSE_LINES + 1)[:-1]
    low, high, _ = search.brackets(line, orders)
    record["caustics"], frame = [], camera.frame()
    for order in range(1, orders + 1):
        crossed = np.isfinite(low[order - 1])
        orders_of = np.full(int(crossed.sum()), order)
        points, _ = search.refined(line[crossed], orders_of, low[order - 1][crossed], high[order - 1][crossed])
        if len(points.edge_phase) < 3:
            continue
        points = _with_mirror_half(points, half)
        record["caustics"].append({"order": order, "cusps": []})
        arrays[f"critical{order}"] = sky_from_fido(frame, -points.line_of_sight)
        arrays[f"caustic{order}"] = np.degrees(np.stack([points.theta, points.azimuth], axis=-1))


def _with_mirror_half(points: Points, half: bool) -> Points:
    return points.joined(points[1:-1].mirrored()) if half else points
