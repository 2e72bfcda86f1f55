"""Light curves of spots, as figures and films: their flux, crossing by crossing, and where on the sky it comes from.

Frames of a film show where the spot's images are at a moment, beside the curve that they add up to.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.draw import style
from kerrcaustics.draw.films import Backdrop, Film, blank_frame, camera_settings
from kerrcaustics.draw.projection import about_shadow, whole_line
from kerrcaustics.draw.sky_axes import name_sky_axes
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.shapes import Float, UInt8
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.isoradials import Isoradial, isoradials

if TYPE_CHECKING:
    from kerrcaustics.light_curves.spot_curve import LightCurve, SpotEvent

Array = np.ndarray

_TURN = 2 * math.pi
# Light fainter than this part of the brightest is not shown; dots fainter than that have the least size.
_FAINTEST, _FAINTEST_DOT = 3e-5, 1e-4
# Points of the image of the orbit.
_POINTS = 1440
# Times that are added about an event, as far from it as so many times that in which the spot moves by its size.
_MOMENTS, _NEAR = 61, 6.0
_NUMERALS = ("first", "second", "third", "fourth", "fifth", "sixth")


def light_curve_figure(light: "LightCurve") -> Figure:
    """Flux against time; below, where the orbit is seen, where images are born and die, and the centroid's way."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.6), layout="constrained")
        upper, lower = figure.subplots(2, 1, height_ratios=[1, 1.1])
        own: Any = show_flux(upper, light).get_legend()
        own.remove()
        show_orbit(lower, light)
        panels = [ax.get_legend_handles_labels() for ax in (upper, lower)]
        entries = {label: handle for handles, labels in panels for handle, label in zip(handles, labels, strict=True)}
        figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=4)
        figure.suptitle(f"spot on an orbit at r = {light.radius:g}; {viewer_in_words(light.camera)}")
    return figure


def crowded_times(light: "LightCurve") -> Float[Array, " times"]:
    """The times of a light curve, and more next to its events, where the flux changes as fast as the spot is small."""
    width = light.size / light.radius * light.period / _TURN
    beside = width * np.linspace(-_NEAR, _NEAR, _MOMENTS)
    added = np.concatenate([light.time, *(event.moment + beside for event in light.events)])
    return np.unique(added[(added >= light.time.min()) & (added <= light.time.max())])


def show_flux(ax: Axes, light: "LightCurve") -> Axes:
    """The flux, what each crossing adds to it, and when images are created (up) and annihilated (down)."""
    order = np.argsort(light.time)
    time = light.time[order]
    ax.semilogy(time, light.flux[order], color="black", label="all")
    for crossing, share in enumerate(light.shares, start=1):
        positive = np.maximum(share[order], 1e-300)
        ax.semilogy(time, positive, color=style.crossing_colour(crossing), lw=1, label=f"{_name(crossing)} crossing")
    for event in light.events:
        ax.axvline(event.moment, color=style.GUIDE_COLOUR, lw=0.6, zorder=0.5)
        ax.plot([event.moment], [1.0], transform=ax.get_xaxis_transform(), clip_on=False, **_event_mark(event))
    ax.set(xlim=(time[0], time[-1]), ylim=(_FAINTEST * light.flux.max(), 2 * light.flux.max()))
    ax.set(xlabel="time of the camera (M)", ylabel=f"flux of a unit spot ({sky_area(light.camera)})")
    ax.legend(ncols=2, loc="lower center", fontsize="small")
    return ax


def _event_mark(event: "SpotEvent") -> dict[str, Any]:
    """The mark of an event, in the colour of its crossing, and its name."""
    colour = style.crossing_colour(event.crossing)
    return {**style.event_mark(event.kind), "markeredgecolor": colour, "label": event.kind}


def show_orbit(ax: Axes, light: "LightCurve") -> None:
    """The images of the orbit about the shadow; creations (up), annihilations (down), the centroid's way (grey)."""
    crossings = len(light.shares)
    edge = shadow_edge(light.camera, 400)
    ax.fill(*about_shadow(light.camera, edge).T, label="shadow", **style.SHADOW)
    for curve in isoradials(light.camera, [light.radius], crossings, _POINTS):
        line = about_shadow(light.camera, whole_line(curve.sky, True))
        ax.plot(*line.T, color=style.crossing_colour(curve.crossing), lw=1)
    way = about_shadow(light.camera, light.centroid)
    ax.plot(*way.T, color="0.4", lw=0.8, ls=(0, (4, 2)), label="centroid of all light")
    for event in light.events:
        ax.plot(*about_shadow(light.camera, event.sky[None]).T, **_event_mark(event))
    name_sky_axes(ax, light.camera.sky_unit)


def sky_area(viewer: Viewer) -> str:
    """The unit of solid angles on the sky of a viewer."""
    return "sr" if viewer.sky_unit == "rad" else "M²"


def _name(crossing: int) -> str:
    return _NUMERALS[crossing - 1] if crossing <= len(_NUMERALS) else f"{crossing}th"


class SpotFrames:
    """An orbit of a spot, drawn frame by frame.

    times (frames,): of the camera. A dot is an image of the spot, the larger the more light it sends, a grey one the
    centroid; those on the curves are the flux at that moment, of each crossing and of all.
    """

    def __init__(self, light: "LightCurve", motion: str, frames: int) -> None:
        """Find the images of the orbit. motion: as it was given to `light_curve`."""
        self.light = light
        self.times = light.time.min() + light.period * np.arange(frames) / frames
        self._orbital = float(EMITTERS[motion](light.camera.spin, light.radius, 0.0).orbital)
        curves = isoradials(light.camera, [light.radius], len(light.shares), _POINTS, motion, time=True)
        self._rings = [(curve.crossing, *_ring(curve, self._orbital, light)) for curve in curves]
        self._brightest = max(float(np.quantile(ring[3], 0.99)) for ring in self._rings)
        order = np.argsort(light.time)
        self._way = about_shadow(light.camera, light.centroid[order])
        self._curves = light.time[order], [light.flux[order], *(share[order] for share in light.shares)]
        with rc_context(style.FILM_RC):
            self.figure = blank_frame()
            self.figure.set_layout_engine("constrained")
            self.axes = self._panels()
            dot = {"edgecolors": "black", "linewidths": 0.6, "zorder": 5}
            colour = style.crossing_colour
            self._spots = {n: self.axes[0].scatter([], [], color=colour(n), **dot) for n, *_ in self._rings}
            colours = ["black", *(colour(n) for n in range(1, len(light.shares) + 1))]
            mark = {"marker": "o", "linestyle": "none", "markeredgecolor": "white", "zorder": 5}
            self._marks = [self.axes[1].plot([], [], color=colour, **mark)[0] for colour in colours]
            self._now = self.axes[1].axvline(self.times[0], color="0.5", linewidth=0.8, zorder=0.5)
            self._centre = self.axes[0].plot([], [], color="0.4", **mark)[0]
            self._backdrop = Backdrop(self.figure, [*self._spots.values(), *self._marks, self._now, self._centre])

    def frame(self, number: int) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame."""
        with rc_context(style.FILM_RC):
            now = float(self.times[number])
            time, values = self._curves
            self._now.set_xdata([now, now])
            for mark, value in zip(self._marks, values, strict=True):
                mark.set_data([now], [np.interp(now, time, value, period=self.light.period)])
            way = (np.interp(now, time, part, period=self.light.period) for part in self._way.T)
            self._centre.set_data(*([part] for part in way))
            for crossing, (places, bright) in self.images(now).items():
                self._spots[crossing].set_offsets(places)
                self._spots[crossing].set_sizes(self._area(bright))
            return self._backdrop.pixels()

    def images(self, time: float) -> dict[int, tuple[Float[Array, "images 2"], Float[Array, " images"]]]:
        """Images of the spot at a time by crossing: places, degrees right and up or (alpha, beta), and brightness."""
        images = {}
        for crossing, place, phase, bright in self._rings:
            turns = (phase - self._orbital * time) / _TURN
            low, high = turns[:-1], turns[1:]
            whole = np.where(high > low, np.floor(high), np.ceil(high))
            joints = np.flatnonzero(np.floor(low) != np.floor(high))
            part = ((whole - low)[joints] / (high - low)[joints]).clip(0, 1)[:, None]
            images[crossing] = place[joints] * (1 - part) + place[joints + 1] * part, bright[joints]
        return images

    def _panels(self) -> tuple[Axes, Axes]:
        left, right = self.figure.subplots(1, 2, width_ratios=[1, 1.25])
        show_orbit(left, self.light)
        left.set_title("where the spot is seen; grey: the centroid")
        show_flux(right, self.light)
        right.set_title(f"its light; orbit at r = {self.light.radius:g}")
        self.figure.suptitle(viewer_in_words(self.light.camera))
        return left, right

    def _area(self, bright: Float[Array, " images"]) -> Float[Array, " images"]:
        """Area of a dot in square points: larger with the logarithm of its light."""
        part = np.log(np.clip(bright / self._brightest, _FAINTEST_DOT, 1)) / -math.log(_FAINTEST_DOT)
        return (4 + 10 * (1 + part)) ** 2


def _ring(
    curve: Isoradial, orbital: float, light: "LightCurve"
) -> tuple[Float[Array, "n 2"], Float[Array, " n"], Float[Array, " n-1"]]:
    """A closed image of the orbit: its points, its phase phi + Omega T, and the light of the spot where it is there."""
    assert curve.time is not None
    sky = np.append(curve.sky, curve.sky[:1], axis=0)
    gained = _TURN * np.round((curve.azimuth[-1] - curve.azimuth[0]) / _TURN)
    azimuth = np.append(curve.azimuth, curve.azimuth[0] + gained)
    phase = azimuth + orbital * np.append(curve.time, curve.time[:1])
    # A spot is so wide in phase: where the phase stands still its light does not grow without bound.
    step = np.linalg.norm(np.diff(sky, axis=0), axis=1) / np.hypot(np.diff(phase), light.size / light.radius)
    return about_shadow(light.camera, sky), phase, curve.redshift**light.power * curve.width * step


def light_curve_film(light: "LightCurve", motion: str = "circular", frames: int = 240, rate: int = 24) -> Film:
    """The film of one orbit of a spot.

    Parameters
    ----------
    light : LightCurve
        At times all over one orbit: `light_curve(camera, orbit, 400)`.
    motion : str
        As it was given to `light_curve`.
    frames, rate : int
        How many, and how many a second.
    """
    frames = whole_number("frames", frames, 2)
    settings = {
        **camera_settings(light.camera),
        "orbit": light.radius,
        "size": light.size,
        "crossings": len(light.shares),
        "power": light.power,
        "times": len(light.time),
        "motion": motion,
    }
    return Film("light_curve", settings, frames, rate, SpotFrames(light, motion, frames).frame)
