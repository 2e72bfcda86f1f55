"""Names that are close to one that exists, and angles that were given in the wrong unit, are reported."""

import copy
import pickle
import tomllib

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics import scripts
from kerrcaustics.choices import if_radians
from kerrcaustics.results.shown import Shown
from kerrcaustics.scene_files import templates
from kerrcaustics.toml_files import numbers_in

CAMERA = kc.Camera(0.9, 10.0)
ATTRIBUTES = {
    "kc.star_image": "Module kerrcaustics has no attribute star_image; did you mean star_images?",
    "kc.skies.Checkerbord": "Module kerrcaustics.skies has no attribute Checkerbord; did you mean Checkerboard?",
    "kc.disks.BlackBodies": "Module kerrcaustics.disks has no attribute BlackBodies; did you mean BlackBody?",
    "kc.pictures.Veiw": "Module kerrcaustics.pictures has no attribute Veiw; did you mean View?",
    "kc.zzz": "Module kerrcaustics has no attribute zzz.",
    "CAMERA.inclinaton": "Camera has no attribute inclinaton; did you mean inclination?",
    "CAMERA.plott": "Camera has no attribute plott; did you mean plot?",
    "CAMERA.zzz": "Camera has no attribute zzz.",
    "CAMERA._spin": "Camera has no attribute _spin.",
}


@pytest.mark.parametrize("code", ATTRIBUTES)
def test_an_attribute_that_is_not_there_may_be_another(code):
    with pytest.raises(AttributeError) as raised:
        eval(code)
    assert str(raised.value) == ATTRIBUTES[code]
    # Python adds no guess of its own.
    assert raised.value.obj is None


def test_results_are_copied_and_pickled_and_have_no_more_attributes_than_before():
    assert pickle.loads(pickle.dumps(CAMERA)) == copy.deepcopy(CAMERA) == CAMERA
    assert not hasattr(CAMERA, "__array__") and getattr(CAMERA, "sweep", 0.0) == 0.0


def test_the_error_within_a_property_is_its_own():
    class Broken(Shown):
        @property
        def width(self):
            return np.zeros(3).widht

    with pytest.raises(AttributeError, match=r"'numpy\.ndarray' object has no attribute 'widht'"):
        _ = Broken().width


CHOICES = {
    "kc.Camera(0.9, 10.0, velocity='cirular')": "but is 'cirular'; did you mean circular?",
    "kc.trace_rays(CAMERA, [[1, 0, 0]], engine='closed')": "but is 'closed'; did you mean closed-form?",
    "kc.trace_rays(CAMERA, [[1, 0, 0]], engine='x')": "auto, closed-form, integrated, but is 'x'.",
    "kc.pictures.View(8, 8, 1.0, 'fish-eye')": "but is 'fish-eye'; did you mean fisheye?",
    "kc.circle_images(CAMERA, 'galactic plan')": "but is 'galactic plan'; did you mean galactic plane?",
}


@pytest.mark.parametrize("code", CHOICES)
def test_a_word_that_is_no_choice_may_be_another(code):
    with pytest.raises(ValueError) as raised:
        eval(code)
    assert str(raised.value).endswith(CHOICES[code])


COMMANDS = {
    ("figures", "star_fields"): "but one is star_fields; did you mean star_field?",
    ("film", "star_feld"): "but is star_feld; did you mean star_field?",
    ("study", "spin_radus"): "but is spin_radus; did you mean spin_radius?",
    ("scene", "--template", "dsk"): "but is dsk; did you mean disk?",
    ("scene", "--template", "zzz"): "but is zzz.",
    ("help",): "but is help; did you mean --help?",
    ("--verson",): "but is --verson; did you mean --version?",
    ("explore", "--spin", "2"): "--spin is unknown; kerrcaustics explore --help lists all options.",
    ("scene", "--template", "disk", "a.toml"): "a.toml must be left out: kerrcaustics scene has no place for it.",
}


@pytest.mark.parametrize("arguments", COMMANDS)
def test_a_name_of_a_script_or_a_template_may_be_another(arguments, assert_refused):
    assert_refused(arguments, COMMANDS[arguments])


KEYS = {
    "camera.radus=3": "camera: unknown key `radus`; did you mean radius?",
    "view.field_of_view=60": "view: unknown key `field_of_view`; did you mean field_of_view_deg?",
    "sky.column=12": "sky: unknown key `column`; did you mean columns?",
    "skys.kind=stars": "unknown key `skys`; did you mean sky?",
    "sky.kind=checkers": (
        "sky.kind must be stars, checkerboard, panorama or none, but is 'checkers'; did you mean checkerboard?"
    ),
    "view.tilt_deg=2 * azimut_deg": (
        "view.tilt_deg must use names that are defined, but azimut_deg is not; did you mean azimuth_deg?"
    ),
    "quality=normel": "quality must be draft, normal or high, but is 'normel'; did you mean normal?",
    "zzz=1": (
        "unknown key `zzz`; its keys are hole, camera, title, quality, definitions, view, sky, disk, volume, spots, "
        "light, film, overlays."
    ),
}


@pytest.mark.parametrize("change", KEYS)
def test_a_key_of_a_scene_may_be_another(change, tmp_path, assert_refused):
    (tmp_path / "scene.toml").write_text(
        "hole = {spin = 0.9}\ncamera = {radius = 10}\nview = {width = 8}\nsky = {kind = 'checkerboard'}\n"
    )
    assert_refused(("render", "scene.toml", "--set", change), f"Scene scene.toml: {KEYS[change]}")


def test_scripts_that_are_loaded_are_reported_too():
    with pytest.raises(ImportError, match="did you mean checkerboard"):
        scripts.FIGURES.load("chekerboard")


DEGREES = {
    "kc.Camera(0.9, 10.0, 90)": "[0, pi] radians, but is 90 (90 degrees are 1.5708 radians).",
    "kc.Observer(spin=0.9, inclination=60)": "[0, pi] radians, but is 60 (60 degrees are 1.0472 radians).",
    "kc.Camera(0.9, 10.0, -1)": "[0, pi] radians, but is -1.",
    "kc.Camera(0.9, 10.0, 200)": "[0, pi] radians, but is 200.",
    "kc.star_images(CAMERA, (80, 60))": "but is (80, 60) (80 degrees are 1.39626 radians).",
    "kc.image_counts(CAMERA, [(1.0, 2.0), (80, 60)])": "(0 to 180 degrees) (80 degrees are 1.39626 radians).",
    "kc.star_tracks(CAMERA, 84)": "but is 84 (84 degrees are 1.46608 radians).",
    "kc.pictures.View(8, 8, 60)": "for a pinhole picture of 8 x 8 pixels, but is 60 (60 degrees are 1.0472 radians).",
}


@pytest.mark.parametrize("code", DEGREES)
def test_degrees_in_the_place_of_radians_are_reported(code):
    with pytest.raises(ValueError) as raised:
        eval(code)
    assert str(raised.value).endswith(DEGREES[code])


@pytest.mark.parametrize(
    ("inclination", "reported"), [("1.5708", True), ("1.047", True), ("1.5", False), ("1.05", False), ("3", False)]
)
def test_radians_in_the_place_of_degrees_are_noted(inclination, reported, capsys):
    # The wrong velocity ends the command before anything is traced.
    arguments = ("caustics", "--spin", "0.9", "--radius", "10", "--inclination", inclination, "--velocity", "circular")
    _, _, err = run(capsys, *arguments)
    assert ("Note: --inclination is in degrees" in err) == reported


def test_radians_in_the_place_of_degrees_are_a_remark_on_a_scene(tmp_path):
    (tmp_path / "scene.toml").write_text(
        "hole = {spin = 0.9}\ncamera = {radius = 10, inclination_deg = 1.5708, azimuth_deg = 1.5}\n"
        "view = {width = 8, field_of_view_deg = 1.05, tilt_deg = -0.785}\nsky = {kind = 'checkerboard', gap = 0.785}\n"
    )
    assert kc.SceneFile.read(tmp_path / "scene.toml").remarks == (
        "camera.inclination_deg is in degrees, but 1.5708 looks like radians: that would be 90 degrees.",
        "view.tilt_deg is in degrees, but -0.785 looks like radians: that would be -45 degrees.",
    )
    for template in templates.first_lines():
        table = tomllib.loads(templates.template_text(template))
        assert not any(if_radians(*entry) for entry in numbers_in(table))


def scene_on_path(tmp_path, path, view="width = 8"):
    text = f"hole = {{spin = 0.9}}\ncamera.velocity = 'fiducial'\nview = {{{view}}}\nsky = {{kind = 'checkerboard'}}\n"
    (tmp_path / "scene.toml").write_text(f"{text}[camera.path]\n{path}\n[film]\nframes = 3\n")
    return kc.SceneFile.read(tmp_path / "scene.toml")


def test_angles_that_may_turn_the_wrong_way_round_are_a_remark(tmp_path):
    """In keyframes, in CSV files and at times; whole turns are meant, as are steps of half a turn."""

    def places(*azimuths):
        return ", ".join(f"{{time = {9 * i}, radius = 20, azimuth_deg = {phi}}}" for i, phi in enumerate(azimuths))

    line = "goes from 359 at t = 9 to 5 at t = 18, through 354 degrees: the short way round ends at 365."
    wrapped = scene_on_path(tmp_path, f'kind = "keyframes"\nkeyframes = [{places(355, 359, 5, 9)}]')
    assert wrapped.remarks == (f"camera.path: azimuth_deg {line}",)
    rows = "".join(f"{9 * i},20,90,{phi}\n" for i, phi in enumerate((355, 359, 5, 175, -175)))
    (tmp_path / "way.csv").write_text(f"time,radius,inclination_deg,azimuth_deg\n{rows}")
    in_file = scene_on_path(tmp_path, 'kind = "csv"\nfile = "way.csv"')
    assert in_file.remarks == (f"camera.path: azimuth_deg {line} It is the first of 2 such steps.",)
    for meant in ((355, 359, 365), (0, 360), (0, 180), (0, 720)):
        assert scene_on_path(tmp_path, f'kind = "keyframes"\nkeyframes = [{places(*meant)}]').remarks == ()
    plain = f'kind = "keyframes"\nkeyframes = [{places(0, 10)}]'
    for key in ("tilt_deg", "yaw_deg", "pitch_deg"):
        values = f"width = 8, {key} = [{{time = 0, value = 170}}, {{time = 9, value = -170}}]"
        (remark,) = scene_on_path(tmp_path, plain, values).remarks
        assert remark.startswith(f"view.{key} goes from 170 at t = 0 to -170 at t = 9, through 340 degrees")
        assert remark.endswith("ends at 190.")


def test_a_path_too_fast_by_such_a_step_says_so(tmp_path):
    text = "hole = {spin = 0.9}\nview = {width = 8}\nsky = {kind = 'checkerboard'}\n[camera]\nvelocity = 'path'\n"
    keys = ", ".join(f"{{time = {i}, radius = 20, azimuth_deg = {phi}}}" for i, phi in enumerate((358, 359, 0, 1)))
    (tmp_path / "scene.toml").write_text(f"{text}[camera.path]\nkind = 'keyframes'\nkeyframes = [{keys}]\n")
    with pytest.raises(ValueError, match=r"camera.path must move slower than light, .* goes from 359 at t = 1 to 0 at"):
        kc.SceneFile.read(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("time;radius;inclination_deg;azimuth_deg", "has semicolons: separate columns by commas"),
        ("time,radius,inclination_deg,azimuth_deg,note", "has more columns: leave out 'note'"),
        ("time,radius,inclination_deg", "lacks azimuth_deg"),
    ],
)
def test_the_first_line_of_a_path_says_what_is_wrong(tmp_path, head, words):
    (tmp_path / "way.csv").write_text(f"{head}\n0,20,90,0,1\n")
    with pytest.raises(ValueError, match=rf"camera.path.file must name a file .*, but that of .*way.csv {words}"):
        scene_on_path(tmp_path, 'kind = "csv"\nfile = "way.csv"')


@pytest.mark.parametrize("path", [r"C:\Users\me\sky.png", r"D:\pictures\sky.png", r"\\server\xsky.png"])
def test_backslashes_in_paths_are_explained(tmp_path, path):
    (tmp_path / "scene.toml").write_text(f'hole = {{spin = 0.9}}\nsky = {{kind = "panorama", file = "{path}"}}\n')
    with pytest.raises(ValueError, match=r"at line 2.*: \\ is an escape in double quotes, so that paths need / or"):
        kc.SceneFile.read(tmp_path / "scene.toml")
