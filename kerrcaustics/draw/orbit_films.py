"""Frames of one orbit: a star's images on the camera sky, and the star among the caustics on the celestial sphere.

An Observer does not orbit: there the star goes round, and its azimuth stands for the time.
"""

import math
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.films import Backdrop, Film, blank_frame, camera_settings
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.projection import azimuthal_equidistant, unrolled_curve, unrolled_places, view_axes
from kerrcaustics.draw.sky_axes import celestial_sphere_axes, critical_line, draw_wrapped
from kerrcaustics.draw.titles import headline
from kerrcaustics.draw.tracks import tracks_on_sky, tracks_unrolled
from kerrcaustics.shapes import Float, UInt8
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.tracks.events import PairEvent, in_time, when
from kerrcaustics.tracks.tracks import StarTracks

Array = np.ndarray

_EDGE_POINTS = 2000
# Factors by which time runs slower around an event, and the part of the orbit over which it does: an image pair parts
# as the square root of the time.
_SLOWER = ((8.0, 0.012), (60.0, 0.0012))
# Frames for which the flash of an event is seen.
_FLASH = 24
# Frames before and after an event in which the caption speaks of it.
_SPEAK = 60
_LINE = 66
_STAR: dict[str, Any] = {"marker": "*", "markersize": 15, "color": STAR_COLOUR, "linestyle": "none", "zorder": 6}
_IMAGE: dict[str, Any] = {"edgecolors": "black", "linewidths": 0.7, "zorder": 5}
_RING: dict[str, Any] = {"linestyle": "none", "marker": "o", "markerfacecolor": "none", "zorder": 7}


class OrbitFrames:
    """An orbit of a camera, drawn frame by frame; time runs slower at pair events, each of which has its own frame.

    Attributes
    ----------
    times : (frames,) array
        Coordinate time of each frame; azimuth of the star, radians, if the camera does not orbit.
    events : dict
        The pair event of a frame, by frame number.
    figure : Figure
        As the last frame drew it. axes: camera sky, unrolled camera sky, celestial sphere.
    """

    def __init__(self, tracks: StarTracks, caustics: CausticSet, frames: int) -> None:
        """Images at all moments; the caustics are of the same camera, orders to max_index + 1."""
        self.tracks, self.caustics = tracks, caustics
        self.times, self.events = _moments(tracks, frames)
        images = tracks.images_at(azimuth=self._azimuth(self.times))
        assert isinstance(images, tuple)
        self.images = images
        self._edge = shadow_edge(tracks.camera, _EDGE_POINTS)
        self._view = view_axes(tracks.camera, self._edge)
        # All at once: the distance to the edge takes its time.
        ends = np.cumsum([0, *(len(image) for image in images)])
        pictures = self._pictures(np.concatenate([image.sky for image in images]))
        self._places = [[picture[i:j] for picture in pictures] for i, j in pairwise(ends)]
        self._event_places = {number: self._pictures(event.sky[None]) for number, event in self.events.items()}
        with rc_context(style.FILM_RC):
            self.figure = blank_frame()
            self.axes = self._panels()
            self._prepare()
            moving = [self._star, self._caption, *self._rings, *(dots for pair in self._dots for dots in pair)]
            self._backdrop = Backdrop(self.figure, moving)

    def frame(self, number: int) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame."""
        with rc_context(style.FILM_RC):
            self.show(number)
            return self._backdrop.pixels()

    def show(self, number: int) -> None:
        """Put the star and its images where they are in a frame."""
        images = self.images[number]
        event = self.events.get(number)
        for index in range(self.tracks.max_index + 1):
            here = images.index == index
            bright, places = images.magnification[here], [places[here] for places in self._places[number]]
            if event is not None and index in event.indices:
                # The pair is one point now.
                bright = np.append(bright, np.inf)
                places = [np.append(a, b, axis=0) for a, b in zip(places, self._event_places[number], strict=True)]
            for dots, picture in zip(self._dots[index], places, strict=True):
                dots.set_offsets(picture)
                dots.set_sizes(_area(bright))
        self._star.set_data(*self._star_at(self._azimuth(self.times[number]))[:, None])
        self._flash(number)
        self._caption.set_text(self.caption(number))

    def _azimuth(self, times: Float[Array, "*frames"] | float) -> Float[Array, "*frames"]:
        """Azimuths of the star at the times of frames, radians."""
        return np.asarray(self.tracks.azimuth_at(times) if self.tracks.angular_velocity else times)

    def _star_at(self, azimuth: float | np.ndarray) -> Float[Array, "2"]:
        """The star on the picture of the celestial sphere."""
        return np.array([(math.degrees(azimuth) + 180) % 360 - 180, math.degrees(self.tracks.level)])

    def caption(self, number: int) -> str:
        """Describe a frame in a few lines."""
        images = self.images[number]
        counts = " + ".join(str(images.per_index[k]) for k in sorted(images.per_index))
        first = f"The star has {counts} images of index 0 to {self.tracks.max_index}."
        ahead, event = min(
            ((n - number, e) for n, e in self.events.items()), key=_closeness, default=(_SPEAK + 1, None)
        )
        if event is None or abs(ahead) > _SPEAK:
            goes = "camera" if self.tracks.angular_velocity else "star"
            second = f"Each runs along its own track while the {goes} goes round the hole."
        else:
            second = self._sentence(event, ahead)
            first = first if ahead else ""
        return "\n".join(fill(text, _LINE) for text in (first, second) if text)

    def _sentence(self, event: PairEvent, ahead: int) -> str:
        """A sentence about an event so many frames ahead."""
        name, (low, high) = style.order_name(event.order), event.indices
        born = event.kind == "creation"
        if high > self.tracks.max_index:
            change = ("will appear", "appears", "has appeared") if born else ("will vanish", "vanishes", "has vanished")
            when = change[int(np.sign(-ahead)) + 1]
            return f"At the {name} critical curve an image of index {low} {when}, and one of index {high}, not drawn."
        if ahead > 0:
            what = "two new images will be born." if born else "two images run towards each other."
            return f"The star comes to the {name} caustic: {what}"
        if ahead == 0:
            what = "two images are born" if born else "two images meet, and vanish,"
            return f"The star crosses the {name} caustic: {what} at one point of the {name} critical curve."
        if born:
            return f"The new images part: index {low} outside the critical curve, index {high} inside."
        return f"The pair is gone: the star has left the {name} caustic."

    def _pictures(self, sky: Float[Array, "n axes"]) -> tuple[Float[Array, "n 2"], Float[Array, "n 2"]]:
        """Places (n, 2) of directions (n, axes) on the two pictures of the camera sky."""
        return azimuthal_equidistant(sky, self._view), unrolled_places(sky, self._view, self._edge)

    def _panels(self) -> tuple[Axes, Axes, Axes]:
        sky = self.figure.add_axes((0.065, 0.205, 0.425, 0.71))
        near = self.figure.add_axes((0.575, 0.615, 0.40, 0.30))
        sphere = self.figure.add_axes((0.575, 0.205, 0.40, 0.30))
        return sky, near, sphere

    def _prepare(self) -> None:
        sky, near, sphere = self.axes
        tracks_on_sky(sky, self.tracks, self.caustics, self._edge)
        tracks_unrolled(near, self.tracks, self.caustics, self._edge)
        for ax in (sky, near):
            for line in ax.lines:
                line.set_alpha(0.35 if line.get_marker() in ("None", "", None) else 0.0)
        self._curves()
        sky.set_title("what the camera sees, looking at the hole")
        near.set_title("the same, near the shadow (its edge is at the bottom)")
        sphere.set_title("where the star is, and the caustics")
        sphere.axhline(math.degrees(self.tracks.level), color=STAR_COLOUR, linewidth=0.8, zorder=1)
        celestial_sphere_axes(sphere, "φ′ from the camera (deg)", 45)
        (self._star,) = sphere.plot([], [], markeredgecolor="black", markeredgewidth=0.8, **_STAR)
        self._dots = [
            [ax.scatter([], [], color=style.index_colour(index), **_IMAGE) for ax in (sky, near)]
            for index in range(self.tracks.max_index + 1)
        ]
        self._rings = [ax.plot([], [], markeredgecolor=STAR_COLOUR, **_RING)[0] for ax in self.axes]
        self._legend()
        star = f"star at θ′ = {math.degrees(self.tracks.level):.6g} deg; {headline(self.caustics)}"
        self.figure.text(0.5, 0.993, star, ha="center", va="top")
        self._caption = self.figure.text(0.03, 0.115, "", fontsize=12.5, va="top", linespacing=1.35)

    def _curves(self) -> None:
        """Critical curves on both pictures of the camera sky, and caustics."""
        sky, near, sphere = self.axes
        for caustic in self.caustics:
            line = {"linewidth": 1.0, "zorder": 1.6, **style.order_line(caustic.order)}
            sky.plot(*critical_line(caustic, self._view).T, **line)
            near.plot(*unrolled_curve(caustic.sky, self._view, self._edge, caustic.closed).T, **line)
            draw_wrapped(sphere, caustic, 1.2, 0.5)

    def _legend(self) -> None:
        """Add a legend with a row for the curves, and one for the images that lie outside them."""
        dot: dict[str, Any] = {"marker": "o", "linestyle": "none", "markeredgecolor": "black", "markeredgewidth": 0.7}
        curves, dots = [], []
        for k in (caustic.order for caustic in self.caustics):
            name = f"{style.order_name(k)} caustic and critical curve"
            curves.append(Line2D([], [], label=name, **style.order_line(k)))
            name = f"image of index {k - 1}{'' if k % 2 else ', mirrored'}"
            dots.append(Line2D([], [], label=name, color=style.index_colour(k - 1), **dot))
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.555, 0.13)}
        self.figure.legend(handles=[*curves, *dots], ncols=2, fontsize=9.5, **place)

    def _flash(self, number: int) -> None:
        """Rings that grow from where a pair has just appeared, or vanished."""
        recent = [n for n in self.events if 0 <= number - n < _FLASH]
        for ring in self._rings:
            ring.set_data([], [])
        for first in recent[:1]:
            age = number - first
            places = [*(picture[0] for picture in self._event_places[first]), self._star_at(self.events[first].star[1])]
            for ring, place in zip(self._rings, places, strict=True):
                ring.set_data(place[:1], place[1:])
                ring.set_markersize(12 + 1.6 * age)
                ring.set_markeredgewidth(2.5 * (1 - age / _FLASH) + 0.3)
                ring.set_alpha(1 - age / _FLASH)


def orbit_film(tracks: StarTracks, caustics: CausticSet, frames: int = 600, rate: int = 30) -> Film:
    """The film of one orbit.

    Parameters
    ----------
    tracks : StarTracks
    caustics : CausticSet
        Of the same camera, orders to max_index + 1.
    frames, rate : int
        How many, and how many a second.
    """
    star = {"theta": tracks.level, "max_index": tracks.max_index, "surface": tracks.surface.in_words()}
    settings = {**camera_settings(tracks.camera), "sky_unit": tracks.camera.sky_unit, **star}
    return Film("orbit", settings, frames, rate, OrbitFrames(tracks, caustics, frames).frame)


def _closeness(entry: tuple[int, PairEvent | None]) -> tuple[int, int]:
    """Nearest event first; of two, the one ahead."""
    return abs(entry[0]), -entry[0]


def _area(magnification: Float[Array, " n"]) -> Float[Array, " n"]:
    """Area of a dot in square points: the brighter, the larger, by the logarithm."""
    decades = np.log10(np.clip(magnification, 1e-4, 1e2))
    return (4.0 + 1.9 * (decades + 4)) ** 2 / 1.6


def _moments(tracks: StarTracks, frames: int) -> tuple[Float[Array, " frames"], dict[int, PairEvent]]:
    """Times of the frames of one orbit, slower at events, and the frames that show an event itself."""
    period = tracks.period if tracks.angular_velocity else 2 * math.pi
    events = in_time((*tracks.events, *tracks.ends))
    at = np.array([when(event) for event in events])
    start = _longest_pause(at, period)
    time = start + np.linspace(0, period, 20_001)
    away = np.abs((time[:, None] - at + period / 2) % period - period / 2) / period
    weight = np.ones_like(time)
    for slower, near in _SLOWER:
        weight += (slower - 1) * np.exp(-((away / near) ** 2)).sum(axis=1)
    run = np.concatenate([[0], np.cumsum((weight[1:] + weight[:-1]) / 2)])
    times = np.interp(np.arange(frames) / frames * run[-1], run, time)
    frames_of = {}
    for event in events:
        moment = start + (when(event) - start) % period
        number = int(np.abs(times - moment).argmin())
        times[number], frames_of[number] = moment, event
    return times, frames_of


def _longest_pause(at: Float[Array, " events"], period: float) -> float:
    """The middle of the longest time without an event, where the orbit begins."""
    if len(at) == 0:
        return 0.0
    gaps = np.diff(np.append(at, at[0] + period))
    return float(at[gaps.argmax()] + gaps.max() / 2)
