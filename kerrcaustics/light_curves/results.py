"""Light curves as results: the light of a source on an orbit, and the events of its images."""

import numpy as np

from kerrcaustics.images.events import Event
from kerrcaustics.interop.row_tables import TimeTable
from kerrcaustics.results.declared import base, derived, quantity, result
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


@base
class LightEvent(Event):
    """Two images of a source on an orbit appear or vanish."""

    camera: Viewer = quantity("", "", "the viewer", column="")
    error: float = quantity("", "GM/c^3", "estimated error of moment")
    sky_error: float = quantity("", "sky", "estimated error of sky; of a spot along the image of its orbit")


@result("source-event/2", record="kind order moment emission_time radius theta phi sky error sky_error")
class SourceEvent(LightEvent):
    """The creation, or annihilation, of two images of a point, or of the centre of a ball."""

    radius: float = quantity("", "GM/c^2", "radius of the source when the light left it")
    theta: float = quantity("", "rad", "theta' of the source then", json="theta_deg")
    phi: float = quantity("", "rad", "phi' of the source then", json="phi_deg")


@result("spot-event/2", record="kind order crossing moment emission_time azimuth sky error sky_error")
class SpotEvent(LightEvent):
    """The creation, or annihilation, of two images of a spot."""

    crossing: int = quantity("", "1", "number of the crossing of the plane, from 1")
    azimuth: float = quantity("", "rad", "azimuth of the spot when the light left it", json="azimuth_deg")


@result(
    "light-curve/2",
    record="source orbit radius size motion power period certified remarks index crossing events",
    points="time flux error shares emission_time emission_time_error redshift sky sky_error centroid centroid_error",
)
class LightCurve(TimeTable):
    """The light of a source on an orbit, as a viewer receives it, image by image.

    An image of a point or a ball has a Morse index. Of a spot all light of one crossing of the equatorial plane is one
    image, whose times, places and frequency ratios are means over that light.
    """

    camera: Viewer = quantity("", "", "the viewer that receives the light", json="", column="")
    source: str = quantity("", "", '"point", "ball" or "spot"')
    orbit: str = quantity("", "", "the orbit, in words")
    radius: float = quantity(
        "", "GM/c^2", "radius of a circular orbit in the equatorial plane; NaN for other orbits", json="orbit_radius"
    )
    size: float = quantity("", "GM/c^2", "radius of a ball; standard deviation of a spot along its orbit; point: 0")
    motion: str = quantity("", "", 'of a spot "circular" or "retrograde"; otherwise empty')
    power: float = quantity("", "1", "power of redshift with which brightness scales: 4 is light of all frequencies")
    period: float = quantity("", "GM/c^3", "period of the orbit; NaN if it has none")
    time: Array = quantity(
        "time",
        "GM/c^3",
        "coordinate time of the viewer, 0 when a circling source is at azimuth 0; an Observer's is that of a plane "
        "wave, later by r + 2 ln r of the observer",
    )
    flux: Array = quantity(
        "time",
        "flux",
        "all light of the requested images. Point or ball: flux for luminosity 1, equal in all directions in its own "
        "frame, for an Observer times the squared distance. Spot: solid angle times redshift^power, for unit intensity "
        "and unit area, r dr dphi in the frame that circles with it. NaN where unknown",
    )
    error: Array = quantity("time", "flux", "estimated error of flux")
    index: Array = quantity("image", "1", "Morse index of each image, which may exist for a while only; -1 for a spot")
    crossing: Array = quantity("image", "1", "crossing of the equatorial plane of a spot's image, from 1; otherwise 0")
    shares: Array = quantity("image time", "flux", "contribution of each image to flux; 0 while it does not exist")
    emission_time: Array = quantity(
        "image time", "GM/c^3", "time when the light left the source; NaN while the image does not exist"
    )
    emission_time_error: Array = quantity("image time", "GM/c^3", "estimated error of emission_time")
    redshift: Array = quantity("image time", "1", "nu_camera / nu_source")
    sky: Array = quantity("image time axis", "1", "directions N of the images; of an Observer (alpha, beta)")
    sky_error: Array = quantity("image time", "sky", "estimated error of sky")
    centroid: Array = quantity(
        "time axis", "1", "mean direction N of the light, a unit vector; of an Observer the mean (alpha, beta)"
    )
    centroid_error: Array = quantity("time", "sky", "estimated error of centroid")
    events: tuple[LightEvent, ...] = quantity("event", "", "creations and annihilations of images, in order of time")
    certified: bool = quantity(
        "",
        "1",
        "Point or ball: True if the images are certified at all moments of complete search, and each of them is "
        "followed to an image at the next moment or to a pair event; pairs that exist only between two moments may be "
        "missing. Spot: True if no image of the orbit, and no event, is missing at the requested crossings: each is "
        "one closed curve round the shadow, along which the azimuth runs as the Morse index says, once round in all",
    )
    remarks: tuple[str, ...] = quantity("", "", "remarks on what is in doubt; empty when certified")

    @property
    @derived("image time", "GM/c^3")
    def travel_time(self) -> Array:
        """Time from the emission to the arrival of the light of each image."""
        return self.time - self.emission_time

    def __repr__(self) -> str:
        """Summary in one line: the source, its orbit, images and events."""
        note = "" if self.certified else ", not certified"
        images = f"{len(self.index)} images" if self.source != "spot" else f"{len(self.crossing)} crossings"
        return f"<LightCurve of a {self.source} on {self.orbit}: {images}, {len(self.events)} events{note}>"
