"""Star tracks: the images of a star over one whole orbit of the camera, as curves on its sky."""

import math
from functools import lru_cache, singledispatch

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.circle_arcs import arcs_of
from kerrcaustics.images.images import StarImages, images_of
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import checked_sheets
from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.lens_map.domains import Domain, Ring, TwoLeaves, domain_of, search_surface
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.lens_map.measured_light import measured_light
from kerrcaustics.level_curves.between_nodes import images_on
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.level_curves.chains import Chain, chains, errors_on_sky
from kerrcaustics.level_curves.path_events import PathEvents, path_events
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.arrays import HostReals
from kerrcaustics.spacetime.checks import numbers, quoted
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.frame import line_of_sight_from_sky
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.tracks.arc_tracks import arc_tracks
from kerrcaustics.tracks.events import PairEvent, PairEvents, arc_events, in_time, pair_events_of
from kerrcaustics.tracks.near_tracks import SeenNodes, branches_from, seen_from
from kerrcaustics.tracks.track import Track

Array = np.ndarray

_TURN = 2 * math.pi
# Times whose images are computed together.
_TOGETHER = 256


@result(
    "tracks/1",
    record="camera surface level max_index angular_velocity period certified remarks tracks events ends",
)
class StarTracks(Shown):
    """All tracks of a source that circles the spin axis, or that is at rest while the camera circles it."""

    camera: Viewer = quantity("", "", "the viewer", json="", column="")
    surface: End = quantity("", "", "surface on which the source lies", json="", column="")
    level: float = quantity("", "level", "theta' of the source; in the plane r", json="star", given=True)
    max_index: int = quantity("", "1", "highest Morse index requested")
    angular_velocity: float = quantity(
        "", "c^3/GM", "coordinate azimuth per coordinate time of the camera; 0 if the source moves instead"
    )
    period: float = quantity("", "GM/c^3", "time of one orbit of the camera; infinite if the source moves instead")
    tracks: tuple[Track, ...] = quantity("track", "", "tracks, those with images of low index first")
    events: PairEvents = quantity(
        "event", "", "pair creations and annihilations of images up to max_index, in order of time"
    )
    ends: tuple[PairEvent, ...] = quantity(
        "end",
        "",
        "events in which an image of index max_index meets one of a higher index: the ends of open tracks",
    )
    certified: bool = quantity(
        "",
        "1",
        "True if the number of images of each index agrees with the certificate at all azimuths (see `StarImages`), "
        "and nothing is in doubt",
    )
    remarks: tuple[str, ...] = quantity("", "", "remarks on what is in doubt; empty when certified")

    def __repr__(self) -> str:
        """Summary in one line: the star, how many tracks and events."""
        doubt = "" if self.certified else ", not certified"
        where = f"{self.surface.coordinates[0].symbol} = {self.level:g}"
        return f"<StarTracks of {where}: {len(self.tracks)} tracks, {len(self.events)} events{doubt}>"

    def azimuth_at(self, time: ArrayLike) -> HostReals:
        """phi' of the star relative to the camera, radians, if it is 0 at time 0."""
        return -self.angular_velocity * numbers("time", time)

    @usual_warnings
    def images_at(
        self, time: ArrayLike | None = None, *, azimuth: ArrayLike | None = None
    ) -> StarImages | tuple[StarImages, ...]:
        """All images at one moment or several: of a star in line with the camera at time 0, or at given azimuths.

        Parameters
        ----------
        time : float or (m,) array
            Coordinate time, units of M.
        azimuth : float or (m,) array
            Instead of the time: phi' of the star relative to the camera, radians.

        Returns
        -------
        StarImages, or a tuple of them for arrays
            As from `star_images`: from the tracks if the star lies on the celestial sphere, or on one beyond the
            camera, and the counts agree; otherwise from a full search.
        """
        if (time is None) == (azimuth is None):
            raise ValueError("Arguments `time` and `azimuth`: exactly one of them must be given.")
        if azimuth is None and not self.angular_velocity:
            raise ValueError("Argument `time` must be left out where the camera does not orbit: give `azimuth`.")
        name, value = ("azimuth", azimuth) if time is None else ("time", time)
        moments = numbers(name, value)
        if moments.ndim > 1 or not np.isfinite(moments).all():
            raise ValueError(
                f"Argument `{name}` must be a finite number or a one-dimensional array, but is {quoted(value)}."
            )
        phi = (moments if time is None else self.azimuth_at(moments)).reshape(-1)
        parts = [self._images(phi[i : i + _TOGETHER]) for i in range(0, len(phi), _TOGETHER)]
        images = tuple(image for part in parts for image in part)
        return images if moments.ndim else images[0]

    def _images(self, phi: Float[Array, " moments"]) -> list[StarImages]:
        """The images at several azimuths."""
        certificate = certificate_of(self.surface, self.camera, self.max_index)
        if not certificate.follows:
            stars = [(self.level, angle) for angle in (phi % _TURN).tolist()]
            return images_of(self.camera, self.surface, stars, certificate.images(np.array(stars)))
        branches = level_curve(self.camera, self.surface, self.level, self.max_index)
        phi, between, sure = images_on(branches, phi)
        stars = [(self.level, angle) for angle in (phi % _TURN).tolist()]
        whole = images_of(self.camera, self.surface, stars, between)
        doubtful = np.flatnonzero(~sure)
        if doubtful.size:
            searched = search(branches.sheets, branches.circle.place(phi[doubtful]))
            images = images_of(self.camera, self.surface, [stars[i] for i in doubtful], searched)
            for i, one in zip(doubtful.tolist(), images, strict=True):
                whole[i] = one
        return whole


@usual_warnings
@with_progress
def star_tracks(
    camera: Viewer,
    level: float,
    max_index: int = 2,
    *,
    end: Wherever | End = math.inf,
    progress: Progress | bool | None = None,
) -> StarTracks:
    """The tracks of all images of a star over one whole orbit of the camera.

    Parameters
    ----------
    camera : Camera or Observer
        A camera on a circular orbit about the spin axis: its velocity is purely azimuthal. For an Observer the star
        moves instead, once round.
    level : float
        theta' of the star in radians; in the plane its r. The images of a star at a pole do not move: their tracks are
        single points.
    max_index : int
        0 to 6: highest Morse index of the images.
    end : float, Sphere or EquatorialPlane
        Radius of the star; math.inf is the celestial sphere. An `EquatorialPlane`: the source
        circles in the plane, seen by any camera outside the plane.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    StarTracks

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Track.error`: every point is refined to round-off. `StarTracks.certified` is True if the tracks hold all images.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> tracks = kc.star_tracks(camera, level=1.5, max_index=1)
    >>> len(tracks.tracks), len(tracks.events), tracks.certified
    (2, 0, True)
    """
    check_viewer(camera)
    surface, highest = search_surface(camera, end), checked_index(max_index)
    height = surface.checked_level("level", level, camera)
    return _tracks_on(domain_of(surface, camera), camera, surface, height, highest)


@singledispatch
def _tracks_on(domain: Domain, camera: Viewer, surface: End, level: float, max_index: int) -> StarTracks:
    """Tracks of a source on a sphere."""
    angular_velocity = camera.orbital_velocity()
    surface.check_apart("level", np.array([[level, 0.0]]), camera)
    events, branches, seen = _level_curve(domain, camera, surface, level, max_index)
    pair_events = pair_events_of(camera, surface, events, level, angular_velocity)
    uncertain = tuple(r for i in np.flatnonzero(~events.known) for r in pair_events[i].remarks)
    differ = ("the events that camera and star see are not the same: tracks cannot be joined",)
    remarks = (*events.remarks, *branches.remarks, *uncertain, *(seen.remarks if seen else differ))
    chosen = in_time(e for e in pair_events if e.order <= max_index)
    return StarTracks(
        camera=camera,
        surface=surface,
        level=level,
        max_index=max_index,
        angular_velocity=angular_velocity,
        period=_TURN / abs(angular_velocity) if angular_velocity else math.inf,
        tracks=_tracks(camera, surface, branches, pair_events, seen) if seen else (),
        events=PairEvents(chosen, camera, surface, not (events.remarks or uncertain), events.remarks),
        ends=in_time(e for e in pair_events if e.order > max_index),
        certified=not remarks,
        remarks=remarks,
    )


@_tracks_on.register
def _tracks_in_ring(domain: Ring, camera: Viewer, surface: End, level: float, max_index: int) -> StarTracks:
    arcs = arcs_of(domain, level)
    events = arc_events(camera, arcs, surface)
    chosen = in_time(event for event in events.values() if event.order <= max_index)
    return StarTracks(
        camera=camera,
        surface=surface,
        level=level,
        max_index=max_index,
        angular_velocity=0.0,
        period=math.inf,
        tracks=arc_tracks(camera, arcs, events, max_index, surface),
        events=PairEvents(chosen, camera, surface, not arcs.remarks, arcs.remarks),
        ends=in_time(event for event in events.values() if event.order == max_index + 1),
        certified=not arcs.remarks,
        remarks=arcs.remarks,
    )


@lru_cache(maxsize=4)
def level_curve(camera: Viewer, surface: End, level: float, max_index: int) -> Branches:
    """The level curve of a star on the viewer's own sheets, kept for images between its nodes."""
    sheets = checked_sheets(camera, max_index, surface)
    return Branches(sheets, camera, Circle(level, surface.axes))


@singledispatch
def _level_curve(
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


@_level_curve.register
def _level_curve_from_star(
    domain: TwoLeaves, camera: Viewer, surface: End, level: float, max_index: int
) -> tuple[PathEvents, Branches, SeenNodes | None]:
    branches = branches_from(camera, level, max_index, domain.surface)
    own = path_events(checked_sheets(camera, max_index, surface), Circle(level, surface.axes))
    return own, branches, seen_from(camera, level, branches, own, domain.surface)


def _tracks(
    camera: Viewer, surface: End, branches: Branches, events: list[PairEvent], seen: SeenNodes
) -> tuple[Track, ...]:
    """The chains of links, as the camera sees them."""
    tracks = [
        _track(LensMap(camera, surface), chain, branches, events, seen) for chain in chains(branches, over_events=True)
    ]
    return tuple(sorted(tracks, key=lambda track: (track.index.min(), not track.closed, len(track))))


def _track(lens_map: LensMap, chain: Chain, branches: Branches, events: list[PairEvent], seen: SeenNodes) -> Track:
    """The track of a chain."""
    chosen, light = chain.nodes, seen.light
    index, event = branches.nodes.index[chosen], seen.events[chosen]
    # Named after a ray with b < 0 where there is one, as caustics are; of low index.
    anchor = np.lexsort((seen.eastward[chosen], index))[0]
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
