"""Star tracks: the images of a star over one whole orbit of the camera, as curves on its sky."""

import math

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.images.images import StarImages
from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.lens_map.domains import domain_of, search_surface
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime.arrays import HostReals
from kerrcaustics.spacetime.checks import numbers, quoted
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.tracks.events import PairEvent, PairEvents
from kerrcaustics.tracks.images_between import images_at_azimuths
from kerrcaustics.tracks.level_tracks import tracks_on
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

    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
    level: float = quantity("", "level", "theta' of the source; in the plane r", json="star", given=True)
    max_index: int = declared.highest_index()
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
    certified: bool = declared.certified(
        "True if the number of images of each index agrees with the certificate at all azimuths (see `StarImages`), "
        "and nothing is in doubt"
    )
    remarks: tuple[str, ...] = declared.remarks()

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
        source = (self.camera, self.surface, self.level, self.max_index)
        parts = [images_at_azimuths(*source, phi[i : i + _TOGETHER]) for i in range(0, len(phi), _TOGETHER)]
        images = tuple(image for part in parts for image in part)
        return images if moments.ndim else images[0]


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
    on_level = tracks_on(domain_of(surface, camera), camera, surface, height, highest)
    return StarTracks(
        camera=camera,
        surface=surface,
        level=height,
        max_index=highest,
        period=_TURN / abs(on_level.angular_velocity) if on_level.angular_velocity else math.inf,
        certified=not on_level.remarks,
        **vars(on_level),
    )
