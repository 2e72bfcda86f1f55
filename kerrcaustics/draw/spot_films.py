"""Films of a spot on its orbit: where its images are at a moment, beside the curve that they add up to."""

import math

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.draw import style
from kerrcaustics.draw.films import Backdrop, Film, blank_frame, camera_settings
from kerrcaustics.draw.light_curves import ORBIT_POINTS, show_flux, show_images
from kerrcaustics.draw.projection import about_shadow
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.interop.physical_scale import PhysicalScale
from kerrcaustics.light_curves.results import LightCurve
from kerrcaustics.shapes import Float, UInt8
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.tracks.isoradials import Isoradial, isoradials

Array = np.ndarray

_TURN = 2 * math.pi
# Dots whose light is fainter than this part of the brightest have the least size.
_FAINTEST_DOT = 1e-4


class SpotFrames:
    """An orbit of a spot, drawn frame by frame.

    times (frames,): of the camera. A dot is an image of the spot, the larger the more light it sends, a grey one the
    centroid; those on the curves are the flux at that moment, of each crossing and of all.
    """

    def __init__(self, light: LightCurve, frames: int, scale: PhysicalScale | None = None) -> None:
        """Find the images of the orbit of a spot; scale: of the axes, as `light_curve_figure` takes it."""
        self.light, self._scale = light, scale
        self._each = 1.0 if scale is None else scale.time_unit[1]
        self.times = light.time.min() + light.period * np.arange(frames) / frames
        self._orbital = float(EMITTERS[light.motion](light.camera.spin, light.radius, 0.0).orbital)
        curves = isoradials(light.camera, [light.radius], len(light.shares), ORBIT_POINTS, light.motion)
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
            self._now = self.axes[1].axvline(self.times[0] * self._each, color="0.5", linewidth=0.8, zorder=0.5)
            self._centre = self.axes[0].plot([], [], color="0.4", **mark)[0]
            self._backdrop = Backdrop(self.figure, [*self._spots.values(), *self._marks, self._now, self._centre])

    def frame(self, number: int) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame."""
        with rc_context(style.FILM_RC):
            now = float(self.times[number])
            time, values = self._curves
            self._now.set_xdata([now * self._each] * 2)
            for mark, value in zip(self._marks, values, strict=True):
                mark.set_data([now * self._each], [np.interp(now, time, value, period=self.light.period)])
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
        show_images(left, self.light, self._scale)
        left.set_title("where the spot is seen; grey: the centroid")
        show_flux(right, self.light, self._scale)
        right.set_title(f"its light; orbit at r = {self.light.radius:g}")
        self.figure.suptitle(viewer_in_words(self.light.camera))
        return left, right

    def _area(self, bright: Float[Array, " images"]) -> Float[Array, " images"]:
        """Area of a dot in square points: larger with the logarithm of its light."""
        part = np.log(np.clip(bright / self._brightest, _FAINTEST_DOT, 1)) / -math.log(_FAINTEST_DOT)
        return (4 + 10 * (1 + part)) ** 2


def _ring(
    curve: Isoradial, orbital: float, light: LightCurve
) -> tuple[Float[Array, "n 2"], Float[Array, " n"], Float[Array, " n-1"]]:
    """A closed image of the orbit: its points, its phase phi + Omega T, and the light of the spot where it is there."""
    sky = np.append(curve.sky, curve.sky[:1], axis=0)
    gained = _TURN * np.round((curve.azimuth[-1] - curve.azimuth[0]) / _TURN)
    azimuth = np.append(curve.azimuth, curve.azimuth[0] + gained)
    phase = azimuth + orbital * np.append(curve.time, curve.time[:1])
    # A spot is so wide in phase: where the phase stands still its light does not grow without bound.
    step = np.linalg.norm(np.diff(sky, axis=0), axis=1) / np.hypot(np.diff(phase), light.size / light.radius)
    return about_shadow(light.camera, sky), phase, curve.redshift**light.power * curve.width * step


def light_curve_film(
    light: LightCurve, frames: int = 240, rate: int = 24, *, scale: PhysicalScale | None = None
) -> Film:
    """The film of one orbit of a spot.

    Parameters
    ----------
    light : LightCurve
        Of a spot, at times all over one orbit: `light_curve(camera, orbit, 400)`.
    frames, rate : int
        How many, and how many a second.
    scale : PhysicalScale, optional
        Of the axes, as `light_curve_figure` takes it.
    """
    if light.source != "spot":
        raise ValueError(f"Argument `light` must be the light curve of a spot, but is that of a {light.source}.")
    frames = whole_number("frames", frames, 2)
    settings = {
        **camera_settings(light.camera),
        "orbit": light.radius,
        "size": light.size,
        "crossings": len(light.shares),
        "power": light.power,
        "times": len(light.time),
        "motion": light.motion,
        **({} if scale is None else {"mass": scale.mass, "distance": scale.distance}),
    }
    return Film("light_curve", settings, frames, rate, SpotFrames(light, frames, scale).frame)
