"""
Motion blur
===========

Paint swatches (above) and the stars of Hipparcos (below) seen by a camera that falls toward a hole of spin 0.999 and
turns to the right while the shutter is open: left, at the one moment in the middle of the exposure, without motion
blur; middle, by swept beams, which need one picture; right, as the mean of 32 pictures, each at its own moment, which
is what the swept beams must reproduce. Remakes JTFT figure A1.

The paper's: blur by swept beams against the mean of many pictures. Ours: the scene, the camera's motion, and swatches
beside the stars; the camera falls by 0.1 M, from r = 6.08 to 5.98, and turns by 2.9 degrees, more than in a frame of a
film, so that the blur is visible. The paper's swept beams take about twice as long as a picture of one moment. So do
ours where the camera circles the hole (1.6 times for stars, 2.8 for swatches, measured at 200 × 160 pixels); where it
falls and turns, as here, they take 8 and 11 times as long, and the mean takes as many times as long as it has pictures.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_picture

SPIN, RADIUS, FALL, TURN = 0.999, 6.03, 0.1, 0.05
VELOCITY = (-0.3, 0.0, 0.2)
SIZE, FIELD = (320, 256), math.radians(75)
SAMPLES = 32


def seen(moment: float) -> tuple[kc.Camera, kc.pictures.View]:
    """The camera, and a view that turns to the right, at a moment of the exposure (-1/2 to 1/2)."""
    camera = kc.Camera(SPIN, RADIUS - FALL * moment, velocity=VELOCITY)
    middle = kc.pictures.View.toward_hole(kc.Camera(SPIN, RADIUS, velocity=VELOCITY), *SIZE, FIELD)
    forward = middle.forward * math.cos(TURN * moment) + middle.right * math.sin(TURN * moment)
    return camera, kc.pictures.View(*SIZE, FIELD, forward=forward, up=middle.up)


def lights(sky: kc.skies.Checkerboard | kc.skies.StarField) -> list[np.ndarray]:
    """The light of one moment, of swept beams, and of many samples."""
    cameras, views = zip(seen(-0.5), seen(0.5), strict=True)
    moments = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    return [
        kc.render(*seen(0.0), sky).light,
        kc.render(*seen(0.0), sky, motion=kc.pictures.ShutterMotion(cameras, views)).light,
        np.mean([kc.render(*seen(float(moment)), sky).light for moment in moments], axis=0),
    ]


def main(output: Path) -> list[Path]:
    titles = "one moment", "swept beams", f"{SAMPLES} samples"
    stars = {"exposure": 1 / 2500, "curve": "asinh", "softening": 25}
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 0.57 * style.PAGE_WIDTH), layout="constrained")
        rows = figure.subplots(2, 3)
        for axes, sky, look in zip(rows, (kc.skies.Checkerboard(), kc.skies.StarField()), ({}, stars), strict=True):
            for ax, light in zip(axes, lights(sky), strict=True):
                show_picture(ax, seen(0.0)[1], kc.pictures.tone_mapped(light, **look))
                ax.set_axis_off()
        for ax, title in zip(rows[0], titles, strict=True):
            ax.set_title(title)
        for ax, name in zip(rows[:, 0], ("paint swatches", "stars"), strict=True):
            ax.annotate(name, (-0.06, 0.5), xycoords="axes fraction", rotation=90, ha="center", va="center")
        motion = f"falls by {FALL} M and turns right by {math.degrees(TURN):.1f} deg"
        figure.suptitle(f"spin {SPIN}, radius {RADIUS}; while the shutter is open the camera {motion}")
    return [write_picture(figure, output / "motion_blur.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
