"""
An orbit without spin
=====================

One orbit at r = 30 round a hole without spin: the stars, and the two that the figure of this name (JTFT 2) picks out, a
bright one in red circles and a dim one in yellow diamonds. Each has one image outside the Einstein ring (violet) and
one inside, on opposite sides of the shadow, that run along the tracks of the star: those outside stream past the hole,
those inside come out of one side of the shadow, swing round it in the opposite sense, and go down on the other side. No
image is ever born or dies. Stars are blurred by the motion of half a frame.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.films import SIZE, Film, blank_frame, pixels
from kerrcaustics.draw.scenes import show_critical_curves, show_line
from kerrcaustics.draw.star_maps import CURVE_COLOUR
from kerrcaustics.draw.tracks import draw_motion, moving_lines
from kerrcaustics.scenes.traced_view import TracedView
from kerrcaustics.scripts import FIGURES
from kerrcaustics.tracks.tracks import StarTracks

FIELD = 150.0
# Radians by which the sky turns in an exposure: that of half a frame, in a film of 240 frames or more.
LONGEST_BLUR = math.pi / 240
# What stands behind words on stars.
BEHIND: dict[str, Any] = {"facecolor": "black", "edgecolor": "none", "alpha": 0.6}


@dataclass(frozen=True)
class Orbit:
    """The orbit of the figure's camera in so many frames."""

    figure: ModuleType
    frames: int

    @cached_property
    def view(self) -> kc.pictures.View:
        return kc.pictures.View.toward_hole(self.figure.CAMERA, *SIZE, math.radians(FIELD), "fisheye")

    @cached_property
    def traced(self) -> TracedView:
        return kc.pictures.trace_view(self.figure.CAMERA, self.view)

    @cached_property
    def caustics(self) -> CausticSet:
        return kc.caustics(self.figure.CAMERA, orders=1)

    @cached_property
    def stars(self) -> list[tuple[StarTracks, tuple[kc.StarImages, ...]]]:
        """The tracks of each star, and its images in each frame."""
        places = [self.figure.star_angles(number) for _, number, _, _ in self.figure.STARS]
        turns = 2 * math.pi * np.arange(self.frames) / self.frames
        tracks = [kc.star_tracks(self.figure.CAMERA, theta, max_index=1) for theta, _ in places]
        return [(star, star.images_at(azimuth=phi - turns)) for star, (_, phi) in zip(tracks, places, strict=True)]

    def draw(self, number: int) -> np.ndarray:
        """The picture (height, width, 3) of a frame."""
        part = number / self.frames
        sky = kc.skies.TurnedSky(self.figure.SKY, -2 * math.pi * part)
        light = self.traced.show(sky, turn=min(math.pi / self.frames, LONGEST_BLUR)).light
        with rc_context(style.FILM_RC):
            frame = blank_frame()
            ax = frame.add_axes((0, 0, 1, 1))
            ax.set_axis_off()
            ax.imshow(kc.pictures.tone_mapped(light, exposure=1 / 2500, curve="asinh", softening=25), aspect="auto")
            show_critical_curves(ax, self.view, self.caustics, on_black=True, color=CURVE_COLOUR, linewidth=1.6)
            for (tracks, images), (*_, marker, colour) in zip(self.stars, self.figure.STARS, strict=True):
                self.draw_tracks(ax, tracks, colour)
                places = self.view.pixels(images[number].sky)
                self.figure.uncover(ax, places)
                look = {"color": colour, "linestyle": "none", "zorder": 4, **self.figure.mark(marker)}
                ax.plot(*places.T, scalex=False, scaley=False, **look)
            caption = f"a = 0, r = 30 on a circular orbit, {part:.2f} of the orbit"
            frame.text(0.02, 0.96, caption, color="white", fontsize=14, va="top", bbox=BEHIND)
            self.draw_legend(ax)
            return pixels(frame)

    def draw_legend(self, ax: Axes) -> None:
        ring = Line2D([], [], label="Einstein ring", color=CURVE_COLOUR, linewidth=1.6)
        handles = [*self.figure.mark_handles(11), ring]
        box = {"facecolor": "black", "edgecolor": "none", "framealpha": BEHIND["alpha"], "labelcolor": "white"}
        ax.legend(handles=handles, loc="lower left", borderaxespad=1.2, **box).set_zorder(5)

    def draw_tracks(self, ax: Axes, star: StarTracks, colour: str) -> None:
        """The tracks of a star, with arrows in the sense in which its images move."""
        for track in star.tracks:
            show_line(ax, self.view, np.concatenate([track.sky, track.sky[:1]]), color=colour, linewidth=0.8)
            for _, line in moving_lines(star, track, self.view.pixels(track.sky), self.view.width / 2):
                draw_motion(ax, line, colour, spacing=0.35, size=14)


def film(frames: int = 240) -> Film:
    orbit = Orbit(FIGURES.load("schwarzschild_tracks"), frames)
    camera = orbit.figure.CAMERA
    return Film("schwarzschild_tracks", {"spin": camera.spin, "radius": camera.radius}, frames, 24, orbit.draw)
