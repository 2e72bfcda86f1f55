"""Star tracks: the images of a star over one whole orbit of the camera, as curves on its sky."""

import math
from dataclasses import field

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.spacetime.camera import Camera, fido_from_sky, sky_from_fido
from kerrcaustics.stars.branches import Branches, Curves
from kerrcaustics.stars.events import (
    PairEvent,
    PairEvents,
    checked_theta,
    in_time,
    orbital_velocity,
    pair_events_of,
)
from kerrcaustics.stars.images import StarImages, checked_sheets, images_of
from kerrcaustics.stars.meetings import meetings
from kerrcaustics.stars.newton import find_roots
from kerrcaustics.stars.search import search

Array = np.ndarray

_TURN = 2 * math.pi
_TOLERANCE = 1e-12
# Newton steps from the interpolated place; a star so many errors from an event is told to be on the caustic.
_FEW_STEPS, _ERRORS = 8, 4.0
# Images of one index that are closer than this on the sky (radians) may be one.
_SAME = 1e-9
# Times whose images are computed together.
_TOGETHER = 256


@result("track/1", record="closed turns places sky azimuth index parity magnification redshift error")
class Track:
    """One connected curve on the camera sky along which images of a star move, through regions of several indices.

    Its points are in the order of the curve; a closed one does not repeat its first point. It leads through the events,
    where images of two indices meet: there `index` is that of the inner side, and `parity` is 0.
    """

    sky: Array = quantity("point axis", "1", "directions N")
    azimuth: Array = quantity(
        "point",
        "rad",
        "phi' of the star relative to the camera at which there is an image here, continuous along the curve. The time "
        "is -azimuth / angular velocity, and any number of periods more",
        json="phi_deg",
    )
    index: Array = quantity("point", "1", "Morse index")
    parity: Array = quantity("point", "1", "(-1)^index")
    magnification: Array = quantity("point", "1", "1 / |det J|")
    redshift: Array = quantity("point", "1", "nu_camera / nu_source")
    error: Array = quantity("point", "rad", "error of sky", json="error_rad")
    closed: bool = quantity(
        "",
        "1",
        "True for a closed curve; else both ends are events of order max_index + 1, beyond which the images have a "
        "higher index",
    )
    turns: int = quantity("", "1", "whole turns by which the azimuth grows along a closed track; 0 for others")
    events: tuple[PairEvent, ...] = quantity("track_event", "", "events in the order of the curve")
    places: tuple[int, ...] = quantity("track_event", "1", "which point each event is", json="event_points")

    def __len__(self) -> int:
        """Number of points."""
        return len(self.index)

    def __repr__(self) -> str:
        """One line: how long, which indices, how many events."""
        indices = sorted(set(self.index.tolist()))
        shape = "closed" if self.closed else "open"
        return f"<Track of {len(self)} points, {shape}, index {indices}, {len(self.events)} events>"


@result("tracks/1", record="camera theta max_index angular_velocity period certified remarks tracks events ends")
class StarTracks:
    """All tracks of a star with a given theta' over one orbit of the camera."""

    camera: Camera = quantity("", "", "the camera", json="", column="")
    theta: float = quantity("", "rad", "theta' of the star", json="star_theta_deg", given=True)
    max_index: int = quantity("", "1", "highest Morse index that was asked for")
    angular_velocity: float = quantity("", "c^3/GM", "of the camera: coordinate azimuth per coordinate time")
    period: float = quantity("", "GM/c^3", "time of one orbit of the camera")
    tracks: tuple[Track, ...] = quantity("track", "", "tracks, those with images of low index first")
    events: PairEvents = quantity(
        "event", "", "pair creations and annihilations of images up to max_index, in the order of time"
    )
    ends: tuple[PairEvent, ...] = quantity(
        "end",
        "",
        "events in which an image of index max_index meets one of a higher index: the ends of open tracks",
    )
    certified: bool = quantity(
        "",
        "1",
        "True when the number of images of each index is at all azimuths what the caustics tell, and nothing is in "
        "doubt",
    )
    remarks: tuple[str, ...] = quantity("", "", "what is in doubt; empty when certified")
    _branches: Branches = field(repr=False)
    _curves: Curves = field(repr=False)

    def __repr__(self) -> str:
        """One line: the star, how many tracks and events."""
        doubt = "" if self.certified else ", not certified"
        return f"<StarTracks of theta' = {self.theta:g}: {len(self.tracks)} tracks, {len(self.events)} events{doubt}>"

    def azimuth_at(self, time: ArrayLike) -> Array:
        """phi' of the star relative to the camera, radians, if it is 0 at time 0."""
        return -self.angular_velocity * np.asarray(time, float)

    def images_at(self, time: ArrayLike | None = None, *, azimuth: ArrayLike | None = None) -> "Images":
        """All images at a moment, or at many: of a star in line with the camera at time 0, or by its azimuth.

        Parameters
        ----------
        time : float or (m,) array
            Coordinate time, units of M.
        azimuth : float or (m,) array
            Instead of the time: phi' of the star relative to the camera, radians.

        Returns
        -------
        StarImages, or a tuple of them for arrays
            As `star_images` gives them: found from the tracks where the counts agree, else by a full search. Tracks
            that were loaded from a file are found anew each time.
        """
        if (time is None) == (azimuth is None):
            raise ValueError("Arguments `time` and `azimuth`: exactly one of them must be given.")
        name, value = ("azimuth", azimuth) if time is None else ("time", time)
        try:
            moments = np.asarray(value, float)
        except (TypeError, ValueError):
            moments = np.array(np.nan)
        if moments.ndim > 1 or not np.isfinite(moments).all():
            raise ValueError(f"Argument `{name}` must be a finite number or a one-dimensional array, but is {value!r}.")
        phi = (moments if time is None else self.azimuth_at(moments)).reshape(-1)
        whole = self if self._branches is not None else star_tracks(self.camera, self.theta, self.max_index)
        parts = [whole._images(phi[i : i + _TOGETHER]) for i in range(0, len(phi), _TOGETHER)]
        images = tuple(image for part in parts for image in part)
        return images if moments.ndim else images[0]

    def _images(self, phi: Array) -> list[StarImages]:
        """The images at several azimuths."""
        branches, theta = self._branches, self.theta
        sheets, found = branches.sheets, branches.meetings
        phi = found.gap_low[0] + (phi - found.gap_low[0]) % _TURN
        moment, index, sky, error = self._interpolated(phi)
        counts = np.zeros((len(phi), self.max_index + 1), int)
        np.add.at(counts, (moment, index), 1)
        gap = np.searchsorted(found.gap_low, phi, side="right") - 1
        away = np.abs((phi[:, None] - found.azimuth + math.pi) % _TURN - math.pi)
        good = (counts == found.counts[gap]).all(axis=1) & ~(away <= _ERRORS * found.error).any(axis=1)
        twice = (moment[1:] == moment[:-1]) & (index[1:] == index[:-1])
        twice &= np.linalg.norm(sky[1:] - sky[:-1], axis=1) < _SAME
        good[moment[1:][twice]] = False
        moving = sky_from_fido(self.camera.frame(), np.stack(fido_from_sky(sheets.frame, tuple(sky.T)), axis=-1))
        beams = trace_beams(self.camera, moving, "auto", _TOLERANCE)
        images = []
        for i, angle in enumerate((phi % _TURN).tolist()):
            if good[i]:
                images.append(
                    _star_images((theta, angle), np.flatnonzero(moment == i), moving, beams, index, error, counts[i])
                )
            else:
                star = (theta, angle)
                images.append(images_of(self.camera, sheets, star, search(sheets, branches.star(phi[i : i + 1]))))
        return images

    def _interpolated(self, phi: Array) -> tuple[Array, Array, Array, Array]:
        """Images on the links that span the azimuths: which azimuth, index, direction on the sky at rest, its error."""
        branches = self._branches
        links = branches.links
        low, high = links.azimuth(links.p_0), links.azimuth(links.p_1)
        where = [
            np.nonzero((low <= a) & (a < high)) for a in (phi[:, None] - _TURN, phi[:, None], phi[:, None] + _TURN)
        ]
        moment = np.concatenate([w[0] for w in where])
        link = np.concatenate([w[1] for w in where])
        azimuth = phi[moment] + np.repeat([-_TURN, 0, _TURN], [len(w[0]) for w in where])
        chosen = links[link]
        part = (chosen.parameter(azimuth) - chosen.p_0) / (chosen.p_1 - chosen.p_0)
        start = branches.chart.sky(chosen.index, self._curves[link].at(part))
        roots = find_roots(branches.sheets.camera, branches.star(azimuth), chosen.index, start, _FEW_STEPS)
        moment, index = moment[roots.start], chosen.index[roots.start]
        order = np.lexsort((roots.sky[:, 0], index, moment))
        return moment[order], index[order], roots.sky[order], roots.error[order]


Images = StarImages | tuple[StarImages, ...]


def star_tracks(camera: Camera, theta: float, max_index: int = 2) -> StarTracks:
    """The tracks of all images of a star over one whole orbit of the camera.

    Parameters
    ----------
    camera : Camera
        On a circular orbit about the spin axis: its velocity has no component but the azimuthal one.
    theta : float
        theta' of the star in radians. The images of a star at a pole stand still: tracks of one point.
    max_index : int
        0 to 6: images with Morse index up to it.

    Returns
    -------
    StarTracks

    Errors
    ------
    `Track.error`: every point is refined to round-off. `StarTracks.certified` tells whether the tracks hold all images.
    """
    angular_velocity = orbital_velocity(camera)
    height = checked_theta(theta)
    sheets = checked_sheets(camera, max_index)
    found = meetings(sheets, height)
    branches = Branches(sheets, camera, height, found)
    events = pair_events_of(camera, angular_velocity, height, found)
    remarks = (*found.remarks, *branches.remarks, *(r for i in np.flatnonzero(~found.known) for r in events[i].remarks))
    return StarTracks(
        camera=camera,
        theta=height,
        max_index=int(max_index),
        angular_velocity=angular_velocity,
        period=_TURN / abs(angular_velocity),
        tracks=_tracks(camera, branches, events),
        events=PairEvents(in_time(e for e in events if e.order <= max_index), found.remarks),
        ends=in_time(e for e in events if e.order > max_index),
        certified=not remarks,
        remarks=remarks,
        _branches=branches,
        _curves=branches.curves(branches.links),
    )


def _star_images(
    star: tuple[float, float], which: Array, sky: Array, beams: Beams, index: Array, error: Array, counts: Array
) -> StarImages:
    """Certified images of one star, out of those of many."""
    per_index = {k: int(count) for k, count in enumerate(counts)}
    return StarImages(
        star=star,
        sky=sky[which],
        azimuth=beams.azimuth[which],
        index=index[which],
        parity=1 - 2 * (index[which] % 2),
        magnification=beams.magnification[which],
        crossings=np.asarray(beams.crossings)[which],
        redshift=np.asarray(beams.redshift)[which],
        error=error[which],
        per_index=per_index,
        expected=per_index,
        on_caustic=(),
        certified=True,
    )


def _tracks(camera: Camera, branches: Branches, events: list[PairEvent]) -> tuple[Track, ...]:
    """The chains of links, as the camera sees them."""
    nodes = branches.nodes
    fido = np.stack(fido_from_sky(branches.sheets.frame, tuple(nodes.sky.T)), axis=-1)
    sky = sky_from_fido(camera.frame(), fido)
    beams = trace_beams(camera, sky, "auto", _TOLERANCE)
    at_event = nodes.event >= 0
    depth = branches.chart.place(np.ones(len(sky), int), nodes.sky)[:, 1]
    along = np.array([event.error for event in events])[nodes.event[at_event]] * math.sin(branches.theta)
    # At an event: along the critical curve by the error of its azimuth, across by that of the beam's ellipse.
    error = nodes.error.copy()
    error[at_event] = ((along + beams.error[at_event]) / beams.delta_plus[at_event]) + math.pi * np.exp(
        -depth[at_event]
    ) * beams.jacobian_error[at_event]
    tracks = []
    for chain, steps, closed in _chains(branches):
        run = np.concatenate([[0.0], np.cumsum(steps)])
        azimuth = nodes.azimuth[chain[0]] + run[: len(chain)]
        # The sum tells the whole turns; each point knows the rest without the sum's round-off.
        azimuth = nodes.azimuth[chain] + _TURN * np.round((azimuth - nodes.azimuth[chain]) / _TURN)
        # Named after a ray with b < 0 where there is one, as caustics are; of low index.
        anchor = np.lexsort((fido[chain, 2] > 0, nodes.index[chain]))[0]
        azimuth += _TURN * np.round((beams.azimuth[chain[anchor]] - azimuth[anchor]) / _TURN)
        places = np.flatnonzero(at_event[chain])
        tracks.append(
            Track(
                sky=sky[chain],
                azimuth=azimuth,
                index=nodes.index[chain],
                parity=np.where(at_event[chain], 0, 1 - 2 * (nodes.index[chain] % 2)),
                magnification=np.where(at_event[chain], np.inf, beams.magnification[chain]),
                redshift=np.asarray(beams.redshift)[chain],
                error=error[chain],
                closed=closed,
                turns=round(run[-1] / _TURN) if closed else 0,
                events=tuple(events[i] for i in nodes.event[chain[places]]),
                places=tuple(places.tolist()),
            )
        )
    return tuple(sorted(tracks, key=lambda track: (track.index.min(), not track.closed, len(track))))


def _chains(branches: Branches) -> list[tuple[Array, Array, bool]]:
    """Connected chains of links: their nodes, the steps in azimuth between these, and whether they close up."""
    links = branches.links
    steps = links.azimuth(links.p_1) - links.azimuth(links.p_0)
    if branches.still:
        return [(np.array([node]), np.zeros(1), True) for node in range(len(branches.nodes.event))]
    partner = _partners(branches)
    ends = np.stack([links.left, links.right], axis=-1).ravel()
    used = np.zeros(len(steps), bool)
    chains = []
    # Open chains first, each from one of its ends; what is left is closed.
    starts = [*np.flatnonzero(partner < 0).tolist(), *range(0, 2 * len(steps), 2)]
    for start in starts:
        if used[start // 2]:
            continue
        chain, way, place = [int(ends[start])], [], start
        while place >= 0 and not used[place // 2]:
            used[place // 2] = True
            way.append(steps[place // 2] * (1 - 2 * (place % 2)))
            # To the other end of the link, and from there to the next link.
            chain.append(int(ends[place ^ 1]))
            place = int(partner[place ^ 1])
        closed = place == start
        nodes, run = np.array(chain[:-1] if closed else chain), np.array(way)
        if run.sum() < 0:
            # Toward larger azimuth on the whole.
            nodes, run = np.roll(nodes[::-1], int(closed)), -run[::-1]
        chains.append((nodes, run, closed))
    return chains


def _partners(branches: Branches) -> Array:
    """Ends of links (2 i: left end of link i, 2 i + 1: right end) that meet in a node, each with the one it goes on to.

    -1 where the curve ends. At a cusp four links meet: the two of one index on one side of it make one curve, the other
    two another.
    """
    links, nodes = branches.links, branches.nodes
    ends = np.stack([links.left, links.right], axis=-1).ravel()
    index = np.repeat(links.index, 2)
    order = np.argsort(ends, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(ends[order])) + 1) if len(order) else []
    partner = np.full(len(ends), -1)
    for group in groups:
        event = nodes.event[ends[group[0]]]
        pairs = [group]
        if event >= 0 and branches.meetings.at_cusp[event]:
            kinds = [(int(index[i]), int(i % 2)) for i in group]
            twins = np.array([kinds.count(kind) == 2 for kind in kinds])
            pairs = [group[twins], group[~twins]]
        for pair in pairs:
            if len(pair) == 2:
                partner[pair] = pair[::-1]
    return partner
