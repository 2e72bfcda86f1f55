"""Pictures of scenes: as files, and on axes with the critical curves."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.draw.scenes import save_picture, show_critical_curves, show_line, show_picture

CAMERA = kc.Camera(spin=0.999, radius=6.03)


def test_a_saved_picture_reads_back_equal(tmp_path):
    picture = np.random.default_rng(4).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    save_picture(tmp_path / "sky.png", picture)
    assert (np.asarray(Image.open(tmp_path / "sky.png")) == picture).all()
    with pytest.raises(ValueError, match="Argument `path` must end"):
        save_picture(tmp_path / "sky.exr", picture)
    with pytest.raises(ValueError, match="Argument `picture` must"):
        save_picture(tmp_path / "sky.png", picture / 255)


def test_degrees_and_curves_lie_on_the_picture():
    view = kc.pictures.View.toward_hole(CAMERA, 300, 200, math.radians(150), "fisheye")
    ax = show_picture(Figure().add_subplot(), view, np.zeros((200, 300, 3), np.uint8))
    labels = {ax.xaxis.get_major_formatter()(place): place for place in ax.xaxis.get_majorticklocs()}
    assert labels["30"] == pytest.approx(149.5 + 60) and labels["−30"] == pytest.approx(149.5 - 60)
    caustics = kc.caustics(CAMERA, orders=1)
    show_critical_curves(ax, view, caustics)
    line = ax.get_lines()[0].get_xydata()
    gap = np.linalg.norm(line[:, None] - view.pixels(caustics[0].sky)[None, ::20], axis=-1).min(axis=0)
    assert gap.max() < 0.1
    assert ax.get_xlim() == (-0.5, 299.5) and ax.get_ylim() == (199.5, -0.5)


def test_lines_round_the_whole_sky_run_to_both_borders_of_the_picture():
    """A great circle through the middle, in steps of 3 pixels: nothing is drawn across the picture."""
    view = kc.pictures.View(360, 180, 2 * math.pi, "equirectangular", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    turn = np.radians(np.arange(1, 360, 3))
    ax = show_picture(Figure().add_subplot(), view, np.zeros((180, 360, 3), np.uint8))
    show_line(ax, view, np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1))
    x, y = ax.get_lines()[0].get_xydata().T
    assert np.isnan(x).sum() == 1 and np.nanmax(np.abs(y - 89.5)) < 1e-9
    assert np.nanmin(x) <= -0.5 and np.nanmax(x) >= 359.5
    assert np.nanmax(np.abs(np.diff(x))) == pytest.approx(3)
