"""Tracks of a star within the camera's radius: those of the camera, as the star sees it, brought to the camera's sky.

As for single images (reciprocal.py), camera and source change places: while the star circles, the camera circles as the
star sees it, further out, where tracks are followed and certified. Every point of them has a b and a q, and with these
a direction on the camera's sky, which is then refined there. Events come from the camera's own caustics.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.beams.ends import Sphere
from kerrcaustics.images.reciprocal import directions, sheets_from
from kerrcaustics.lens_map.lens_map import LensMap, SearchMap
from kerrcaustics.lens_map.measured_light import MeasuredLight, measured_light
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import search_camera
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.level_curves.path_events import PathEvents
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.frame import line_of_sight_from_sky, photon_of, sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_TURN = 2 * math.pi
# Newton steps from the direction that b and q give.
_FEW_STEPS = 12
# Largest difference in longitude of one event computed from both ends, radians.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class SeenNodes:
    """The nodes of a level curve as the camera sees them.

    light: light of each node.
    eastward: True where photons move eastward at the camera.
    events: number of the event that each node is, -1 where it is none.
    remarks: one for each doubt.
    """

    light: MeasuredLight
    eastward: Bool[Array, " nodes"]
    events: Int[Array, " nodes"]
    remarks: tuple[str, ...] = ()


def branches_from(camera: Viewer, theta: float, max_index: int, end: Sphere) -> Branches:
    """The level curve of the camera, as a star on a sphere within its radius sees it."""
    if math.sin(theta) < 1e-12:
        raise ValueError(
            "Argument `level` must lie between 0 and pi for a star within the camera's radius, whose tracks are "
            f"followed from the star, but is {quoted(theta)}."
        )
    if camera.on_axis:
        raise ValueError("Argument `camera` must not lie on the spin axis for tracks of a star within its radius.")
    star_camera, sheets = sheets_from(search_camera(camera), theta, max_index, end)
    return Branches(sheets, star_camera, Circle.about_spin_axis(camera.inclination))


def seen_from(camera: Viewer, theta: float, branches: Branches, own: PathEvents, end: Sphere) -> SeenNodes | None:
    """The nodes on the camera's sky; own: the events there; None where they are not those of branches."""
    nodes = branches.nodes
    partners = _partners(branches, own)
    if partners is None:
        return None
    rest = search_camera(camera)
    place = from_angles(np.full(len(nodes.longitude), theta), nodes.longitude)
    photon = photon_of(branches.sheets.frame, tuple(nodes.sky.T))
    # Photons that move inward at the star pass a turning point before they reach the camera.
    second_arrival = np.asarray(photon.rate[0]) > 0
    sky = _nearest(rest, np.asarray(photon.b), np.asarray(photon.q), second_arrival, place, end)
    at_event = nodes.event >= 0
    which = np.where(at_event, partners[nodes.event] if len(partners) else -1, -1)
    error, lost = np.full(len(sky), np.nan), 0
    for leaf in (False, True):
        on_leaf = np.flatnonzero((second_arrival == leaf) & ~at_event)
        converged, new_sky, off = find_roots(
            rest, place[on_leaf], nodes.index[on_leaf], sky[on_leaf], _FEW_STEPS, end=replace(end, second_arrival=leaf)
        )
        sky[on_leaf[converged]], error[on_leaf[converged]] = new_sky, off
        lost += len(on_leaf) - len(converged)
    events = which[at_event]
    sky[at_event] = sky_from_line_of_sight(rest.frame(), own.points.line_of_sight[events])
    lens_map = LensMap(camera, end)
    at = lens_map.light_at(sky, second_arrival)
    along = own.error[events] * math.sin(theta) + at.beams.error[at_event]
    error[at_event] = along / at.spread[at_event] + at.beams.diameter_error[at_event]
    eastward = line_of_sight_from_sky(rest.frame(), sky)[:, 2] < 0
    remarks = (f"{lost} points of tracks could not be found on the camera's sky",) if lost else ()
    measured = measured_light(lens_map, at, sky, error, second_arrival)
    return SeenNodes(measured, eastward, which, remarks)


def _partners(branches: Branches, own: PathEvents) -> Int[Array, " events"] | None:
    """The event on the camera's sky for each on the star's sky; None where the two lists differ."""
    events = branches.events
    count = len(own.order)
    if len(events.order) != count:
        return None
    left, partners = np.ones(count, bool), np.empty(count, int)
    for i in range(count):
        away = np.abs((own.longitude - events.longitude[i] + math.pi) % _TURN - math.pi)
        away[~left | (own.order != events.order[i])] = np.inf
        partners[i] = int(away.argmin())
        if not away[partners[i]] < _SAME:
            return None
        left[partners[i]] = False
    return partners


def _nearest(
    camera: Viewer,
    b: Float[Array, " n"],
    q: Float[Array, " n"],
    second_arrival: Bool[Array, " n"],
    place: Float[Array, "n 3"],
    end: Sphere,
) -> Float[Array, "n 3"]:
    """Directions with this b and q: of the two, one up and one down, the one that leads to the star."""
    both = [directions(camera, b, q, sign) for sign in (1.0, -1.0)]
    traced = [SearchMap(camera, end).beams_of_sky(sky, second_arrival) for sky in both]
    miss = [np.linalg.norm(beams.direction - place, axis=1) for beams in traced]
    up = np.nan_to_num(miss[0], nan=np.inf) <= np.nan_to_num(miss[1], nan=np.inf)
    return np.where(up[:, None], *both)
