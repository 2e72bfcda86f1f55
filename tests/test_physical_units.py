"""Times in minutes and places in microarcseconds: figures, films, tables and commands, for a hole of known mass."""

import csv
import json
import math
import re

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.draw.light_curves import light_curve_figure
from kerrcaustics.draw.spot_films import SpotFrames, light_curve_film


@pytest.mark.parametrize(
    ("mass", "unit", "each"),
    [(10.0, "ms", 0.0493), (2e4, "ms", 98.5), (1e5, "s", 0.493), (4.3e6, "min", 0.353), (6.5e9, "d", 0.3706)],
)
def test_times_have_a_unit_that_suits_the_mass(mass, unit, each):
    name, value = kc.PhysicalScale(mass).time_unit
    assert name == unit and value == pytest.approx(each, rel=1e-3)


@pytest.fixture(scope="module")
def light():
    """With two events."""
    observer = kc.Observer(spin=0.9, inclination=1.4)
    return kc.light_curve(observer, 8.0, 12, crossings=2)


def test_a_light_curve_is_drawn_in_minutes_and_microarcseconds(light):
    scale = kc.PhysicalScale(4.3e6, 8180)
    ax, plain = light.plot(scale=scale), light.plot()
    assert ax.get_xlabel() == "time of the viewer (min)" and plain.get_xlabel() == "time of the viewer (M)"
    np.testing.assert_allclose(ax.lines[0].get_xdata(), plain.lines[0].get_xdata() * scale.seconds / 60)
    with pytest.raises(ValueError, match="Argument `scale` must be a PhysicalScale, but is float"):
        light.plot(scale=21.2)
    sky = light_curve_figure(light, scale).axes[1]
    assert (sky.get_xlabel(), sky.get_ylabel()) == ("α (µas)", "β (µas)")
    sky.figure.canvas.draw()
    for tick in sky.get_xticklabels():
        assert float(tick.get_text().replace("−", "-")) == pytest.approx(tick.get_position()[0] * scale.microarcseconds)
        assert float(tick.get_text().replace("−", "-")) % 5 == 0
    assert light_curve_figure(light, kc.PhysicalScale(4.3e6)).axes[1].get_xlabel() == "α (M)"


@pytest.mark.parametrize("command", ["images --star 80 170 --max-index 1", "light-curve --orbit 8 --times 5"])
def test_tables_are_in_physical_units(command, capsys):
    place = ["--spin", "0.9", "--radius", "inf", "--inclination", "60"]
    scale = kc.PhysicalScale(4.3e6, 8180)
    plain = run(capsys, *command.split(), *place)[1]
    status, out, _ = run(capsys, *command.split(), *place, "--mass", "4.3e6", "--distance", "8180")
    assert status == 0 and "time (min)" in out
    if command.startswith("images"):
        row, before = (re.findall(r"^ *1 .*$", text, re.M)[0].split() for text in (out, plain))
        assert "alpha, beta (uas)" in out and "errors on the sky in microarcseconds" in out
        assert float(row[2]) == pytest.approx(float(before[2]) * scale.microarcseconds, abs=1e-4)
        assert float(row[-1]) == pytest.approx(float(before[-1]) * scale.seconds / 60, abs=1e-5)
    else:
        period, before = (float(re.search(r"period ([\d.]+)", text)[1]) for text in (out, plain))
        assert period == pytest.approx(before * scale.seconds / 60)


def columns_of(path):
    """The columns of a CSV file, by name."""
    names, *rows = csv.reader(path.open())
    return dict(zip(names, np.array(rows, float).T, strict=True))


def test_tables_of_a_light_curve_name_the_unit_of_times_and_places(light, tmp_path):
    fits = pytest.importorskip("astropy.io.fits")
    scale = kc.PhysicalScale(4.3e6, 8180)
    light.to_csv(tmp_path / "plain.csv")
    light.to_csv(tmp_path / "light.csv", scale)
    light.to_fits(tmp_path / "light.fits", scale=scale)
    plain, table = columns_of(tmp_path / "plain.csv"), columns_of(tmp_path / "light.csv")
    minutes, uas = scale.seconds / 60, scale.microarcseconds
    units = {"time": minutes, "travel_time_1": minutes, "emission_time_error_1": minutes}
    units |= {"centroid_alpha": uas, "sky_1_beta": uas, "sky_error_1": uas, "centroid_error": uas}
    for name, each in units.items():
        ending = "min" if each == minutes else "uas"
        assert name not in table
        np.testing.assert_array_equal(table[f"{name}_{ending}"], plain[name] * each)
    # Other quantities, and all without a scale, are what they are.
    assert {"flux", "redshift_1", "share_1"} < set(table) & set(plain) and len(table) == len(plain)
    with fits.open(tmp_path / "light.fits") as parts:
        kinds = {column.name: column.unit for column in parts["LIGHT"].columns}
        assert list(kinds) == list(table) and kinds["time_min"] == "min" and kinds["centroid_alpha_uas"] is None
        assert "[uas]" in parts["LIGHT"].header[f"TCOMM{list(kinds).index('centroid_alpha_uas') + 1}"]
        assert len(light.events) and {"moment_min", "error_min", "sky_alpha_uas"} < set(parts["EVENTS"].columns.names)
    # Without a distance places stay in M, and those of a camera are directions.
    light.to_csv(tmp_path / "light.csv", kc.PhysicalScale(4.3e6))
    assert {"time_min", "centroid_alpha"} < set(columns_of(tmp_path / "light.csv"))
    kc.light_curve(kc.Camera(0.5, 50.0, 1.0, "static"), 8.0, 3, crossings=1).to_csv(tmp_path / "light.csv", scale)
    assert {"time_min", "centroid_x", "centroid_error"} < set(columns_of(tmp_path / "light.csv"))


@pytest.mark.stand_ins
@pytest.mark.parametrize("write", ["to_csv", "to_fits"])
def test_a_number_is_no_scale_of_a_table(light, write, tmp_path):
    with pytest.raises(ValueError, match="Argument `scale` must be a PhysicalScale, but is float"):
        getattr(light, write)(tmp_path / "light", 21.2)
    assert not list(tmp_path.iterdir())


def test_the_times_of_a_command_are_in_the_unit_of_its_tables(capsys, tmp_path):
    place = ["light-curve", "--spin", "0.9", "--radius", "inf", "--orbit", "8", "--crossings", "1", "--times", "3"]
    files = ["--during", "10", "40", "--table", tmp_path / "light.csv", "--json", tmp_path / "light.json", "--points"]
    status, out, _ = run(capsys, *place, *files, "--mass", "4.3e6")
    assert status == 0 and all(f"{head} (min)" in out for head in ("at time", "from", "to"))
    np.testing.assert_allclose(columns_of(tmp_path / "light.csv")["time_min"], [10, 25, 40])
    # Records are in units of the mass.
    times = json.loads((tmp_path / "light.json").read_text())["time"]
    np.testing.assert_allclose(times, np.array([10, 25, 40]) * 60 / kc.PhysicalScale(4.3e6).seconds)


@pytest.mark.slow
def test_a_film_of_a_spot_has_minutes_on_its_axes(light):
    scale = kc.PhysicalScale(4.3e6, 8180)
    frames, plain = SpotFrames(light, 4, scale), SpotFrames(light, 4)
    assert frames.axes[1].get_xlabel() == "time of the viewer (min)" and frames.axes[0].get_xlabel() == "α (µas)"
    # Of all light, and of each crossing.
    for drawn, each in ((frames, scale.seconds / 60), (plain, 1.0)):
        drawn.frame(2)
        places = [mark.get_xdata()[0] for mark in drawn.axes[1].lines if len(mark.get_xdata()) == 1]
        assert np.isclose(places, drawn.times[2] * each, rtol=1e-12).sum() == 3
    settings = [light_curve_film(light, 4, scale=each).settings for each in (scale, None)]
    assert settings[0] == {**settings[1], "mass": 4.3e6, "distance": 8180}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--radius inf --distance 8180", "Argument --distance must be used with --mass."),
        ("--radius 50 --mass 4e6 --distance 8180", "--distance must be used with --observer or --radius inf"),
        ("--radius inf --mass -1", "Argument --mass must be a positive, finite number of solar masses, but is -1.0."),
    ],
)
def test_masses_and_distances_that_nothing_uses_are_refused(options, words, assert_refused):
    assert_refused(("images", "--spin", "0.9", "--star", "80", "170", *options.split()), words)
    assert_refused(("light-curve", "--spin", "0.9", "--orbit", "8", *options.split()), words)


def test_the_ratio_to_the_unlensed_star_is_what_a_camera_there_has(capsys):
    place = ["images", "--spin", "0.9", "--radius", "100", "--inclination", "60", "--star", "80", "170"]
    status, out, _ = run(capsys, *place, "--observer")
    assert status == 0 and "magnification (M^2/sr)" in out and "solid angle of an image by that of the star" in out
    star = math.radians(80), math.radians(170)
    images = kc.star_images(kc.Camera(0.9, 100.0, math.radians(60), velocity="fiducial"), star)
    ratios = [float(line.split()[6]) for line in re.findall(r"^ *[012]  .*$", out, re.M)]
    np.testing.assert_allclose(ratios, images.magnification, rtol=1e-3)
    # At infinity there is none, and of a camera the magnification is the ratio.
    for others in (["--velocity", "fiducial"], ["--observer", "--source-radius", "300"]):
        assert "ratio" not in run(capsys, *place, *others, "--max-index", "0")[1]


def test_the_ratio_of_a_star_of_finite_size_is_that_of_a_point_where_it_is_small(capsys):
    options = ["--spin", "0.9", "--radius", "100", "--inclination", "60", "--star", "80", "170"]
    status, out, _ = run(capsys, "magnification", *options, "--observer", "--size", "0.01")
    heads, *rows = (re.split(r"  +", line.strip()) for line in out.splitlines() if "  " in line)
    assert status == 0 and heads == ["index", "magnification (M^2/sr)", "error", "ratio", "error of ratio"]
    assert "ratio: light of the images by that of the star without the hole\n" in out
    star = math.radians(80), math.radians(170)
    images = kc.star_images(kc.Camera(0.9, 100.0, math.radians(60), velocity="fiducial"), star)
    points = [images.magnification[images.index == index].sum() for index in range(3)]
    ratios, errors = (np.array([row[column] for row in rows], float) for column in (3, 4))
    np.testing.assert_allclose(ratios, [*points, sum(points)], rtol=1e-5)
    assert (errors > 0).all() and (errors < 1e-5 * ratios).all()
    # There is none at infinity, for cameras, and for stars at a finite radius.
    infinite = ["--spin", "0.9", "--radius", "inf", "--star", "80", "170"]
    for others in (infinite, options, [*options, "--observer", "--source-radius", "300"]):
        assert "ratio" not in run(capsys, "magnification", *others, "--size", "0.01", "--max-index", "0")[1]
