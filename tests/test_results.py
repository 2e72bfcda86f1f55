"""Every result, by what it declares: files that load back equal, records for JSON, Datasets, docstrings, equality."""

import copy
import json
import math
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_results import CAMERA, GIVEN, KINDS, example
from marks import few
from offenders import for_each

import kerrcaustics as kc
from kerrcaustics.beams.paths import SpacePoints
from kerrcaustics.curves.caustic import Cusp
from kerrcaustics.results.declared import LAYOUTS, quantities, stored
from kerrcaustics.results.storage import HOMES, as_json, from_json
from kerrcaustics.results.units import as_in
from kerrcaustics.tracks.events import PairEvent, PairEvents
from kerrcaustics.tracks.track import Track
from kerrcaustics.tracks.tracks import StarTracks

NOT_OURS = "Argument `path` must name a file that `kerrcaustics.save` wrote, but "


@for_each(kind=KINDS, how=[(0, False), (1, True), (3, False)])
def test_a_file_loads_back_equal(kind, how, tmp_path):
    made = example(kind, *how)
    kc.save(tmp_path / "a file", made)
    loaded = kc.load(tmp_path / "a file")
    assert type(loaded) is kind and loaded == made
    assert [path.name for path in tmp_path.iterdir()] == ["a file"]
    assert pickle.loads(pickle.dumps(made)) == made and copy.deepcopy(made) == made


def test_several_results_lie_in_one_file(tmp_path):
    many = tuple(example(kind, 2) for kind in KINDS)
    kc.save(tmp_path / "all", many)
    assert kc.load(tmp_path / "all") == many


@for_each(kind=KINDS)
def test_equality_sees_every_field(kind):
    made = example(kind, 2)
    for name, about in stored(kind).items():
        if kind not in GIVEN and not name.startswith("_"):
            # How long it took is no part of a result.
            assert (replace(made, **{name: "something else"}) == made) == (about.unit == "s")
    for name, part in vars(made).items():
        if isinstance(part, np.ndarray) and part.size:
            changed = part.copy()
            changed.flat[-1] = ~part.flat[-1] if part.dtype.kind in "bi" else np.nextafter(part.flat[-1], 9)
            assert replace(made, **{name: changed}) != made
    assert made != 1


# Records that have changed once since others rely on them.
SECOND = {f"kerrcaustics/{name}/2" for name in ("caustics", "event", "light-curve", "source-event", "spot-event")}


@for_each(kind=KINDS, count=[0, 1, 3])
def test_a_record_is_json_whose_names_say_the_unit(kind, count):
    made = example(kind, count)
    entry = json.loads(json.dumps(kc.record(made, points=True), allow_nan=False))
    assert re.fullmatch(r"kerrcaustics/[a-z-]+/1", entry["schema"]) or entry["schema"] in SECOND
    layout = LAYOUTS[kind]
    for name in layout.names + layout.points + layout.rows:
        if "=" in name:
            assert dict([name.split("=")]).items() <= entry.items()
            continue
        about = as_in(made, quantities(kind)[name])
        names = (about.name + "_deg" * (about.unit == "rad") if about.json is None else about.json).split()
        assert about.unit != "rad" or all(key.endswith(("_deg", "_rad")) for key in names)
        assert name in layout.rows or set(names) <= entry.keys()
    assert {"spin", "radius", "inclination_deg", "velocity"} <= kc.record(made, camera=CAMERA).keys()


def test_angles_are_degrees_in_records_and_rows_have_names():
    images = example(kc.StarImages, 3)
    entry = kc.record(replace(images, star=(math.radians(60), math.radians(-17))), camera=CAMERA)
    assert entry["star_deg"] == [60, -17] and entry["per_index"] == {"0": 1, "1": 2, "2": 3, "3": 4}
    assert [row["phi_deg"] for row in entry["images"]] == [None, *np.degrees(images.azimuth[1:])]
    assert [row["error_rad"] for row in entry["images"]] == [None, *images.error[1:]]
    assert [row["index"] for row in entry["images"]] == [-1, 0, 1]


def test_units_and_names_belong_to_viewer_and_surface():
    seen = example(kc.StarImages, 3)
    far = kc.Observer(spin=0.5, inclination=1.0)
    plane = replace(seen, camera=far, surface=kc.EquatorialPlane(2), star=(8.0, math.radians(30)))
    entry, sphere = kc.record(plane), kc.record(seen)
    assert (entry["star_radius"], entry["star_phi_deg"], entry["crossing"], entry["radius"]) == (8.0, 30.0, 2, None)
    assert "star_deg" in sphere and sphere["radius"] == CAMERA.radius and sphere["source_radius"] == 7.5
    assert "error" in entry["images"][0] and "error_rad" in sphere["images"][0]
    units = [kc.to_xarray(one).magnification.attrs["units"] for one in (seen, plane, replace(seen, camera=far))]
    assert units == ["1", "1", "(GM/c^2)^2"]
    assert kc.to_xarray(replace(plane, camera=CAMERA)).magnification.attrs["units"] == "c^4/(GM)^2"


@pytest.mark.parametrize("count", few((0, 1, 3), (1,)))
@for_each(kind=KINDS)
def test_a_dataset_holds_every_number(kind, count, tmp_path):
    made = example(kind, count)
    data = kc.to_xarray(made)
    for name, about in quantities(kind).items():
        about = as_in(made, about)
        number = getattr(made, name)
        if isinstance(number, np.ndarray):
            variable = data[about.column or name]
            np.testing.assert_array_equal(variable.values, number)
            assert variable.attrs == {"units": about.unit, "long_name": about.text}
            assert variable.dims == tuple(dim.removesuffix("...") for dim in about.dims)
        elif isinstance(number, int | float | str) and about.column is None:
            assert data.attrs[name] == number
    if count != 1:
        data.to_netcdf(tmp_path / "data.nc", engine="h5netcdf")


def test_datasets_pad_what_is_shorter():
    track = example(Track, 2)
    short = replace(track, sky=track.sky[:1], index=track.index[:1], events=(), places=())
    data = kc.to_xarray(replace(example(StarTracks, 1), tracks=(track, short)))
    assert data.track_sky.dims == ("track", "point", "axis") and list(data.axis) == ["x", "y", "z"]
    np.testing.assert_array_equal(data.track_sky[0], track.sky)
    assert np.isnan(data.track_sky[1, 1]).all()
    np.testing.assert_array_equal(data.track_index, [[-1, 0], [-1, -1]])
    assert data.track_event_kind.values.tolist() == [["a word", "a word"], ["", ""]]
    assert data.event_star.dims == ("event", "angle") and data.end_moment.attrs["units"] == "GM/c^3"
    assert data.track_turns.dims == ("track",) and data.attrs["period"] == 0.1 + 0.2
    quiet = kc.to_xarray(replace(example(StarTracks, 1), events=example(PairEvents, 0)))
    assert quiet.event_indices.shape == (0, 2) and quiet.event_sky.shape == (0, 3) and quiet.sizes["track_event"] == 1


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
def test_rays_of_any_shape(shape, tmp_path):
    """With captured rays among them, which hold NaN, and with what was not asked for None."""
    sky = np.broadcast_to([-1.0, 0.0, 0.0], (*shape, 3)).copy()
    sky[..., 0] *= -np.linspace(-1, 1, math.prod(shape)).reshape(shape)
    sky[..., 2] = 0.3
    for made in (kc.trace_rays(CAMERA, sky), kc.trace_beams(CAMERA, sky)):
        kc.save(tmp_path / "rays", made)
        assert kc.load(tmp_path / "rays") == made
        data = kc.to_xarray(made)
        assert data.direction.shape == (*shape, 3) and "time" not in data
        assert ("redshift" in data) == ("index" in data) == (type(made) is kc.Beams)
        assert kc.record(made, camera=CAMERA)["status"] == made.status.tolist()
    assert shape == () or not made.escaped.all()
    np.testing.assert_array_equal(data.magnification, made.magnification)


@for_each(kind=KINDS)
def test_docstrings_say_every_field(kind):
    text = " ".join(kind.__doc__.split())
    for name, about in stored(kind).items():
        if not name.startswith("_"):
            assert f"{name} :" in text or f"{name}," in text
            assert kind in GIVEN or about.text[1:] in text


def test_the_page_says_every_public_result(monkeypatch):
    docs = Path(__file__).parents[1] / "docs"
    monkeypatch.syspath_prepend(docs)
    from result_list import result_list

    rows = re.findall(r"^\| `(\w+)` \| .{9,} \| `(kerrcaustics/[^`]+)` \|$", result_list(), re.MULTILINE)
    assert dict(rows) == {kind.__name__: LAYOUTS[kind].schema for kind in KINDS} and len(rows) == len(KINDS)
    assert "<!-- results -->" in (docs / "results.md").read_text(encoding="utf-8")


def test_files_know_where_every_result_is_defined():
    reported = {f"kerrcaustics.{home}.{name}" for home, names in HOMES.items() for name in names.split()}
    assert reported == {f"{kind.__module__}.{kind.__name__}" for kind in KINDS}


def test_a_fresh_process_loads_what_is_no_public_name(tmp_path):
    made = example(SpacePoints, 2)
    kc.save(tmp_path / "points", made)
    code = f"import kerrcaustics as kc; print(kc.load({str(tmp_path / 'points')!r}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == repr(made)


@pytest.mark.parametrize("content", [b"", b"not a file of ours", b"PK\x03\x04broken"])
def test_a_foreign_file_is_refused(content, tmp_path):
    (tmp_path / "other.npz").write_bytes(content)
    with pytest.raises(ValueError, match=NOT_OURS):
        kc.load(tmp_path / "other.npz")


def test_a_file_that_was_cut_off_is_refused(tmp_path):
    kc.save(tmp_path / "whole", example(kc.Rays, 3))
    content = (tmp_path / "whole").read_bytes()
    for size in (len(content) - 1, len(content) // 2, 30):
        (tmp_path / "part").write_bytes(content[:size])
        with pytest.raises(ValueError, match=NOT_OURS):
            kc.load(tmp_path / "part")


@pytest.mark.parametrize(
    "part", [CAMERA, kc.Camera(0.5, 9, velocity=(0.1, 0, 0)), kc.CelestialSphere(), kc.Sphere(20.0)]
)
def test_small_results_are_one_text(part):
    kinds = [type(part).__name__]
    assert from_json(as_json(part), kinds) == part
    for text in (as_json(kc.EquatorialPlane(1)), "[]", "{}", "no text", as_json(part).replace("}", ', "more": 1}')):
        with pytest.raises(ValueError):
            from_json(text, kinds)


def test_a_missing_file_and_another_schema_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"must name a file that can be read: .*nothing.npz': No such file"):
        kc.load(tmp_path / "nothing.npz")
    np.savez(tmp_path / "later.npz", head=np.array(json.dumps({"schema": "kerrcaustics/result/9"})))
    with pytest.raises(ValueError, match=r"schema kerrcaustics/result/1, but this one is .*/9"):
        kc.load(tmp_path / "later.npz")


@pytest.mark.parametrize("change", [("Cusp", "Cuspid"), ("celestial", "place"), ("array_0", "array_7")])
def test_a_file_of_other_results_or_fields_is_refused(change, tmp_path):
    kc.save(tmp_path / "cusp", example(Cusp, 1))
    with np.load(tmp_path / "cusp") as file:
        arrays = dict(file)
    np.savez(tmp_path / "x.npz", **{**arrays, "head": np.array(str(arrays["head"]).replace(*change))})
    with pytest.raises(ValueError, match=NOT_OURS):
        kc.load(tmp_path / "x.npz")


@pytest.mark.parametrize("use", [kc.record, kc.to_xarray, lambda other: kc.save("nowhere/file", other)])
@pytest.mark.parametrize("other", [1, {}, np.zeros(3), object])
def test_what_is_no_result_is_refused(use, other):
    with pytest.raises(ValueError, match="Argument `result` must be a result of kerrcaustics, but is "):
        use(other)


@pytest.mark.parametrize(
    ("surface", "names"), [(kc.CelestialSphere(), ["theta", "phi"]), (kc.EquatorialPlane(1), ["radius", "phi"])]
)
def test_datasets_name_the_coordinates_of_the_surface(surface, names):
    event = replace(example(PairEvent, 1), surface=surface)
    assert list(kc.to_xarray(event).angle.values) == names


def test_endings_of_other_formats_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"Argument `path` must not end in \.fits"):
        kc.save(tmp_path / "camera.fits", kc.Camera(0.9, 10.0))
    assert not list(tmp_path.iterdir())


# Names that mean one thing in some results and another in others, and what.
TWO_MEANINGS = {
    "error": "of what the result is about: a direction, a moment, a flux, a field",
    "beams": "the beams of paths; the number that were traced",
    "points": "a surface; the points of a sweep",
    "ends": "of curves; events at which tracks end",
    "flux": "of a source; of a line profile, which is that of its disk",
    "magnification": "of a beam, without a unit; of images, which depends on viewer and surface",
    "orbit": "of light curves in words; of photons its radius",
    "per_index": "numbers; contributions to a magnification",
    "real": "parts of a field; of a visibility, an area times a brightness",
    "imaginary": "as real",
    "total": "a number; a magnification",
    "source": "of light curves its kind; of magnifications its place",
    "size": "a length; along the surface of a source",
    "width": "pixels; a length on the sky",
}


def test_names_have_one_meaning():
    """One unit, but for derivatives, which are named after what is derived."""
    units = {}
    for kind in KINDS:
        if not kind.__name__.endswith("Derivatives"):
            for one in quantities(kind).values():
                units.setdefault(one.name, set()).add(one.unit)
    assert {name for name, found in units.items() if len(found) > 1} == set(TWO_MEANINGS)


def test_times_have_one_meaning():
    """`time` is a travel time but on the axis of light curves; events have a `moment` of the viewer."""
    travel, events = re.compile("coordinate time from|coordinate time between|travel time"), set()
    for kind in KINDS:
        for one in quantities(kind).values():
            if one.name == "time" and one.dims != ("time",):
                assert travel.search(one.text), f"{kind.__name__}.time: {one.text}"
            if one.name == "moment":
                events.add(kind.__name__)
    assert events == {"PairEvent", "SourceEvent", "SpotEvent"}
