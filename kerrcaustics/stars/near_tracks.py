"""Tracks of a star within the camera's radius: those of the camera, as the star sees it, brought to the camera's sky.

As for single images (reciprocal.py), camera and source change places: while the star circles, the camera circles as the
star sees it, further out, where tracks are followed and certified. Every point of them has a b and a q, and with these
a direction on the camera's sky, which is then refined there. Events come from the camera's own caustics.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import Sphere, Spherical
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.curves.source_map import on_leaves
from kerrcaustics.spacetime.camera import Camera, Frame, as_seen, photon, sky_from_looking
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.stars.events import PairEvent
from kerrcaustics.stars.level_curves.branches import Branches
from kerrcaustics.stars.level_curves.circle import Circle
from kerrcaustics.stars.newton import find_roots
from kerrcaustics.stars.reciprocal import motion, sheets_from
from kerrcaustics.stars.sheets import TOLERANCE

Array = np.ndarray

_TURN = 2 * math.pi
# Newton steps from the place that b and q tell; by how much events may differ in longitude, seen from both ends.
_FEW_STEPS, _SAME = 12, 1e-6


@dataclass(frozen=True, eq=False)
class SeenNodes:
    """The nodes of a level curve as the camera sees them.

    sky: directions N; beams; error of N, radians; rest: N for the camera at rest, in its frame; events: which event
    each node is, -1 where it is none; remarks: what is in doubt.
    """

    sky: Float[Array, "nodes 3"]
    beams: Beams
    error: Float[Array, " nodes"]
    rest: Float[Array, "nodes 3"]
    frame: Frame
    events: Int[Array, " nodes"]
    remarks: tuple[str, ...] = ()


def branches_from(camera: Camera, theta: float, max_index: int, end: Sphere) -> Branches:
    """The level curve of the camera, as a star on a sphere within its radius sees it."""
    if math.sin(theta) < 1e-12:
        raise ValueError(
            "Argument `theta` must lie between 0 and pi for a star within the camera's radius, whose tracks are "
            f"followed from the star, but is {theta!r}."
        )
    there, sheets = sheets_from(camera.at_rest(), theta, max_index, end)
    return Branches(sheets, there, Circle.about_spin_axis(camera.inclination))


def seen_from(
    camera: Camera, theta: float, branches: Branches, events: list[PairEvent], end: Sphere
) -> SeenNodes | None:
    """The nodes on the camera's sky; None where the events are not those of the star's own sky."""
    nodes = branches.nodes
    partners = _partners(branches, events)
    if partners is None:
        return None
    rest = camera.at_rest()
    place = from_angles(np.full(len(nodes.longitude), theta), nodes.longitude)
    light = photon(branches.sheets.frame, tuple(nodes.sky.T))
    # Of photons that come in at the star the ways lead on inward, and out again.
    returning = np.asarray(light.rate[0]) > 0
    sky = _nearest(rest, np.asarray(light.b), np.asarray(light.q), returning, place, end)
    at_event = nodes.event >= 0
    which = np.where(at_event, partners[nodes.event] if len(partners) else -1, -1)
    error, lost = np.full(len(sky), np.nan), 0
    for leaf in (False, True):
        these = np.flatnonzero((returning == leaf) & ~at_event)
        found, there, off = find_roots(
            rest, place[these], nodes.index[these], sky[these], _FEW_STEPS, end=replace(end, returning=leaf)
        )
        sky[these[found]], error[these[found]] = there, off
        lost += len(these) - len(found)
    frame = rest.frame(), camera.frame()
    seen = as_seen(sky, *frame)
    for i in np.flatnonzero(at_event).tolist():
        seen[i] = events[which[i]].sky
    sky = as_seen(seen, frame[1], frame[0])
    beams = _traced(camera, seen, returning, end)
    of_events = np.array([event.error for event in events])[which[at_event]] * math.sin(theta)
    error[at_event] = (of_events + beams.error[at_event]) / beams.delta_plus[at_event] + beams.jacobian_error[at_event]
    remarks = (f"{lost} points of tracks could not be found on the camera's sky",) if lost else ()
    return SeenNodes(seen, beams, error, sky, frame[0], which, remarks)


def _partners(branches: Branches, events: list[PairEvent]) -> Int[Array, " meetings"] | None:
    """For each meeting on the star's sky the event on the camera's; None where they are not the same ones."""
    found = branches.meetings
    if len(found.order) != len(events):
        return None
    longitude, order = (np.array([getattr(e, name) for e in events]) for name in ("longitude", "order"))
    left, partners = np.ones(len(events), bool), np.empty(len(events), int)
    for i in range(len(events)):
        away = np.abs((longitude - found.longitude[i] + math.pi) % _TURN - math.pi)
        away[~left | (order != found.order[i])] = np.inf
        partners[i] = int(away.argmin())
        if not away[partners[i]] < _SAME:
            return None
        left[partners[i]] = False
    return partners


def _nearest(
    camera: Camera,
    b: Float[Array, " n"],
    q: Float[Array, " n"],
    returning: Bool[Array, " n"],
    place: Float[Array, "n 3"],
    end: Sphere,
) -> Float[Array, "n 3"]:
    """Directions with this b and q: of the two, one up and one down, the one that leads to the star."""
    both = [sky_from_looking(camera.frame(), -motion(camera, b, q, sign)) for sign in (1.0, -1.0)]
    miss = [np.linalg.norm(_traced(camera, sky, returning, end).direction - place, axis=1) for sky in both]
    up = np.nan_to_num(miss[0], nan=np.inf) <= np.nan_to_num(miss[1], nan=np.inf)
    return np.where(up[:, None], *both)


def _traced(camera: Camera, sky: Float[Array, "n 3"], returning: Bool[Array, " n"], end: Sphere) -> Beams:
    def traced(sky: Array, end: Spherical) -> Beams:
        return trace_beams(camera, sky, "auto", TOLERANCE, end=end)

    return on_leaves(end, sky, returning, traced)
