"""Tracks of a source along a circle of a surface, by a method for each domain."""

import math
from dataclasses import dataclass
from functools import lru_cache, singledispatch

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.images.circle_arcs import arcs_of
from kerrcaustics.images.sheets import checked_sheets
from kerrcaustics.lens_map.domains import Domain, Ring, TwoLeaves
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.lens_map.measured_light import measured_light
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.level_curves.chains import Chain, chains, errors_on_sky
from kerrcaustics.level_curves.path_events import PathEvents, path_events
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.frame import line_of_sight_from_sky
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.arc_tracks import arc_tracks
from kerrcaustics.tracks.events import PairEvent, PairEvents, arc_events, in_time, pair_events_of
from kerrcaustics.tracks.near_tracks import SeenNodes, branches_from, seen_from
from kerrcaustics.tracks.track import Track

Array = np.ndarray

_TURN = 2 * math.pi


@dataclass(frozen=True)
class LevelTracks:
    """All tracks of a source that circles, or whose camera does."""

    angular_velocity: float
    """That of the camera; 0 if the source moves instead."""
    tracks: tuple[Track, ...]
    """Those with images of low index first."""
    events: PairEvents
    """Events of the images that are requested."""
    ends: tuple[PairEvent, ...]
    """Events in which those meet images of a higher index."""
    remarks: tuple[str, ...]
    """Doubts; nothing is missing if there are none."""


@singledispatch
def tracks_on(domain: Domain, camera: Viewer, surface: End, level: float, max_index: int) -> LevelTracks:
    """Tracks of a source on a sphere."""
    angular_velocity = camera.orbital_velocity()
    surface.check_apart("level", np.array([[level, 0.0]]), camera)
    followed, branches, at = _events_and_branches(domain, camera, surface, level, max_index)
    events = pair_events_of(camera, surface, followed, level, angular_velocity)
    uncertain = tuple(r for i in np.flatnonzero(~followed.known) for r in events[i].remarks)
    differ = ("the events that camera and star see are not the same: tracks cannot be joined",)
    remarks = (*followed.remarks, *branches.remarks, *uncertain, *(at.remarks if at else differ))
    chosen = in_time(e for e in events if e.order <= max_index)
    return LevelTracks(
        angular_velocity=angular_velocity,
        tracks=_tracks(camera, surface, branches, events, at) if at else (),
        events=PairEvents(chosen, camera, surface, not (followed.remarks or uncertain), followed.remarks),
        ends=in_time(e for e in events if e.order > max_index),
        remarks=remarks,
    )


@tracks_on.register
def _tracks_in_ring(domain: Ring, camera: Viewer, surface: End, level: float, max_index: int) -> LevelTracks:
    arcs = arcs_of(domain, level)
    events = arc_events(camera, arcs, surface)
    chosen = in_time(event for event in events.values() if event.order <= max_index)
    return LevelTracks(
        angular_velocity=0.0,
        tracks=arc_tracks(camera, arcs, events, max_index, surface),
        events=PairEvents(chosen, camera, surface, not arcs.remarks, arcs.remarks),
        ends=in_time(event for event in events.values() if event.order == max_index + 1),
        remarks=arcs.remarks,
    )


@lru_cache(maxsize=4)
def level_curve(camera: Viewer, surface: End, level: float, max_index: int) -> Branches:
    """The level curve of a star on the viewer's own sheets, kept for images between its nodes."""
    sheets = checked_sheets(camera, max_index, surface)
    return Branches(sheets, camera, Circle(level, surface.axes))


@singledispatch
def _events_and_branches(
    domain: Domain, camera: Viewer, surface: End, level: float, max_index: int
) -> tuple[PathEvents, Branches, SeenNodes | None]:
    """Events of a star, its level curve, and that as the camera sees it."""
    branches = level_curve(camera, surface, level, max_index)
    frame, nodes = branches.sheets.frame, branches.nodes
    lens_map = LensMap(camera, surface)
    light = lens_map.light_at(nodes.sky)
    measured = measured_light(lens_map, light, nodes.sky, errors_on_sky(branches, light, branches.events.error))
    eastward = line_of_sight_from_sky(frame, nodes.sky)[:, 2] < 0
    return branches.events, branches, SeenNodes(measured, eastward, nodes.event)


@_events_and_branches.register
def _followed_from_star(
    domain: TwoLeaves, camera: Viewer, surface: End, level: float, max_index: int
) -> tuple[PathEvents, Branches, SeenNodes | None]:
    branches = branches_from(camera, level, max_index, domain.surface)
    own = path_events(checked_sheets(camera, max_index, surface), Circle(level, surface.axes))
    return own, branches, seen_from(camera, level, branches, own, domain.surface)


def _tracks(
    camera: Viewer, surface: End, branches: Branches, events: list[PairEvent], at: SeenNodes
) -> tuple[Track, ...]:
    """The chains of links, as the camera sees them."""
    tracks = [
        _track(LensMap(camera, surface), chain, branches, events, at) for chain in chains(branches, over_events=True)
    ]
    return tuple(sorted(tracks, key=lambda track: (track.index.min(), not track.closed, len(track))))


def _track(lens_map: LensMap, chain: Chain, branches: Branches, events: list[PairEvent], at: SeenNodes) -> Track:
    """The track of a chain."""
    chosen, light = chain.nodes, at.light
    index, event = branches.nodes.index[chosen], at.events[chosen]
    # Named after a ray with b < 0 where there is one, as caustics are; of low index.
    anchor = np.lexsort((at.eastward[chosen], index))[0]
    turns = np.round((light.azimuth[chosen[anchor]] - chain.longitude[anchor]) / _TURN)
    places = np.flatnonzero(event >= 0)
    return Track(
        camera=lens_map.viewer,
        surface=lens_map.surface,
        sky=light.sky[chosen],
        azimuth=chain.longitude + _TURN * turns,
        index=index,
        parity=np.where(event >= 0, 0, 1 - 2 * (index % 2)),
        magnification=np.where(event >= 0, np.inf, light.magnification[chosen]),
        magnification_error=np.where(event >= 0, np.inf, light.magnification_error[chosen]),
        redshift=light.redshift[chosen],
        redshift_error=light.redshift_error[chosen],
        time=light.time[chosen],
        time_error=light.time_error[chosen],
        error=light.error[chosen],
        closed=chain.closed,
        turns=round(chain.sweep / _TURN) if chain.closed else 0,
        events=tuple(events[i] for i in event[places]),
        places=tuple(places.tolist()),
    )
