"""Measured curves of a film or a sensor: the colours of black bodies that they give, and the files they come from."""

import numpy as np
import pytest

import kerrcaustics as kc

WAVELENGTHS = np.arange(360.0, 831.0)
FILM = np.stack([np.exp(-(((WAVELENGTHS - c) / 25) ** 2) / 2) for c in (640, 545, 445)], axis=-1)
SCENE = """
hole = {spin = 0.6}
camera = {radius = 20}
view = {width = 16, height = 10, field_of_view_deg = 60}
disk = {inner = 5, outer = 12, emission = {kind = "black-body", peak = 4500}}
light = {response = {file = "film.csv"}}
"""


def test_the_curves_of_the_model_film_are_that_film():
    measured = kc.pictures.MeasuredResponse(WAVELENGTHS, FILM * [1.0, 7.0, 0.2])
    kelvin = np.geomspace(1000, 30_000, 40)
    one, other = (kc.pictures.black_body(kelvin, response=response) for response in ("film", measured))
    assert np.allclose(one, other, rtol=1e-12)


def test_a_narrow_layer_sees_plancks_law():
    """Ratios of layers at single wavelengths, over those of the white black body."""
    lines = np.array([460.0, 540.0, 620.0])
    wavelengths = np.sort(np.concatenate([lines - 2, lines, lines + 2]))
    curves = np.zeros((9, 3))
    curves[[7, 4, 1], [0, 1, 2]] = 1

    def planck(kelvin):
        return lines[::-1] ** -5 / np.expm1(1.438776877e7 / (lines[::-1] * kelvin))

    response = kc.pictures.MeasuredResponse(wavelengths, curves)
    found = kc.pictures.black_body(3500.0, response=response)
    assert found == pytest.approx(planck(3500.0) / planck(6504.0), rel=2e-3)


@pytest.mark.parametrize("form", ["{:g},{:g},{:g},{:g}", "{:g} {:g}\t{:g}   {:g}", " {:.3e}; {:.3e}; {:.3e}; {:.3e}"])
def test_curves_are_read_from_a_file(tmp_path, form):
    rows = [(400, 0, 0, 1), (500, 0, 0.5, 0.25), (600, 1, 0.125, 0)]
    lines = ["# a film", "wavelength_nm,red,green,blue", "", *(form.format(*row) for row in rows)]
    (tmp_path / "film.csv").write_text("\n".join(lines))
    response = kc.pictures.MeasuredResponse.read(tmp_path / "film.csv")
    assert response.wavelengths.tolist() == [400, 500, 600]
    assert np.array_equal(response.sensitivities, np.array(rows)[:, 1:])
    between = response.interpolated(np.array([350.0, 450.0, 601.0])).T
    assert between.tolist() == [[0, 0, 0], [0, 0.25, 0.625], [0, 0, 0]]


def test_everything_that_shines_by_its_temperature_takes_curves():
    response = kc.pictures.MeasuredResponse(WAVELENGTHS, FILM)
    kc.skies.StarField(response=response)
    for emission in (kc.disks.BlackBody, kc.disks.PageThorne, kc.disks.PowerLaw):
        assert emission(4500.0, response=response).response is response
    kc.disks.Spots([6.0], [0.0], response=response)
    kc.disks.Wisps(4500.0, 6.0, 9.0, response=response)
    kc.disks.Volume(0.1, 4500.0, 6.0, 9.0, response=response)


@pytest.mark.parametrize(
    ("wavelengths", "curves", "words"),
    [
        ([500.0], [[1, 1, 1]], "`wavelengths` must hold two growing numbers"),
        ([500.0, 400.0], np.ones((2, 3)), "`wavelengths` must hold two growing numbers"),
        ([400.0, 500.0], np.ones((2, 4)), "`sensitivities` must have shape"),
        ([400.0, 500.0], [[1, 1, 1], [1, 1, -1]], "`sensitivities` must hold"),
        ([400.0, 500.0], [[1, 1, 0], [1, 1, 0]], "`sensitivities` must be above 0"),
        ([100.0, 200.0], np.ones((2, 3)), "`sensitivities` must be above 0"),
    ],
)
def test_what_is_no_response_is_refused(wavelengths, curves, words):
    with pytest.raises(ValueError, match=words):
        kc.pictures.MeasuredResponse(wavelengths, curves)


def test_a_scene_file_names_curves(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    with pytest.raises(ValueError, match=r"light\.response\.file must name a file that can be read"):
        kc.SceneFile.read(tmp_path / "scene.toml")
    for text, words in (("1 2 3", "four numbers"), ("words", "two growing numbers"), ("1 2 3 4\n0 1 1 1", "growing")):
        (tmp_path / "film.csv").write_text(text)
        with pytest.raises(ValueError, match=rf"scene.toml: light.response.file must .*{words}"):
            kc.SceneFile.read(tmp_path / "scene.toml")
    np.savetxt(tmp_path / "film.csv", np.column_stack([WAVELENGTHS, FILM]), delimiter=",")
    scene = kc.SceneFile.read(tmp_path / "scene.toml")
    assert dict(scene.files).keys() == {"film.csv"}
    emission = scene.matter.disk.emission
    found = kc.pictures.black_body(4500.0, response=emission.response)
    assert found == pytest.approx(kc.pictures.black_body(4500.0, response="film"), rel=1e-3)
