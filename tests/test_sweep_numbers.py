"""The numbers of a sweep: against the functions that make them, other programs and closed forms."""

import json
import math

import numpy as np
import pytest
import xarray
from scipy.interpolate import make_interp_spline
from sweeping import opened

import kerrcaustics as kc
from kerrcaustics.sweeps.quantities import computed
from kerrcaustics.sweeps.scene import Scene

EVERYTHING = ("geometry", "cusps", "areas", "curves", "counts", "magnification")

# Extents and circuits of a = 0.999 at r = 6.03 by two other tracers, in degrees, to the digits given.
KNOWN = {
    "theta_extent": [0.4233, 71.83, 131.75],
    "phi_extent": [0.4511, 263.02, 1876.432],
    "circuits": [0.0013, 0.731, 5.212],
    "phi_min": [167.4713, 48.128, -1426.497],
    "phi_max": [167.9224, 311.146, 449.935],
}
DIGITS = {
    "theta_extent": [4, 2, 2],
    "phi_extent": [4, 2, 3],
    "circuits": [4, 3, 3],
    "phi_min": [4, 3, 3],
    "phi_max": [4, 3, 3],
}


@pytest.fixture(scope="module")
def at_603(tmp_path_factory):
    path = tmp_path_factory.mktemp("sweep") / "at_603.zarr"
    scene = Scene(0.999, 6.03, orders=3, compute=EVERYTHING, map_rows=8, directions=512, curve_points=600)
    assert kc.sweep(scene, path).failures == ()
    return opened(path).load().isel(spin=0, radius=0, inclination=0)


def test_store_holds_the_known_numbers(at_603):
    for name, numbers in KNOWN.items():
        for value, number, digits in zip(at_603[name].values, numbers, DIGITS[name], strict=True):
            assert abs(value - number) <= 0.51 * 10.0**-digits, name
    assert at_603.cusp_count.values.tolist() == [4, 4, 4] and at_603.closed.values.tolist() == [1, 1, 1]
    assert at_603.status == 1


def test_store_holds_what_the_functions_return(at_603):
    camera = kc.Camera(0.999, 6.03)
    for i, caustic in enumerate(kc.caustics(camera, 3)):
        for name in ("theta_min", "theta_max", "phi_min", "phi_max", "theta_extent", "phi_extent"):
            assert at_603[name][i] == math.degrees(getattr(caustic, name))
            assert math.degrees(caustic.error) <= at_603[f"{name}_error"][i] <= 2.01 * math.degrees(caustic.error)
        assert at_603.circuits[i] == caustic.circuits and at_603.residual[i] == caustic.residual
        cusps = np.degrees([cusp.celestial for cusp in caustic.cusps])
        assert np.array_equal(np.stack([at_603.cusp_theta[i, :4], at_603.cusp_phi[i, :4]], axis=-1), cusps)
        assert np.isnan(at_603.cusp_theta[i, 4:]).all() and (at_603.cusp_error[i, :4] > 0).all()
        filled = int(np.isfinite(at_603.curve_theta[i]).sum())
        assert filled == min(600, len(caustic.sky)) and np.isfinite(at_603.curve_sky[i, :filled]).all()
        stored = np.stack([at_603.curve_theta[i, :filled], at_603.curve_phi[i, :filled]], axis=-1)
        whole = np.degrees(caustic.celestial)
        assert np.array_equal(stored, whole[np.arange(filled) * len(whole) // filled])
    world = kc.count_map(camera, 2, 8)
    assert np.array_equal(at_603.image_count, world.counts)
    assert np.allclose(np.radians(at_603.theta), world.level, rtol=0, atol=1e-15)
    assert np.array_equal(at_603.image_count_on_caustic, world.on_caustic)
    assert np.allclose(np.radians(at_603.phi), world.phi, rtol=0, atol=1e-15)


def test_every_variable_has_units_and_an_error_beside_it(at_603):
    exact = {"cusp_count", "closed", "residual", "image_count", "image_count_on_caustic", "status", "reason", "digest"}
    shared = {
        "cusp_theta": "cusp",
        "cusp_phi": "cusp",
        "curve_theta": "curve",
        "curve_phi": "curve",
        "curve_sky": "curve",
    }
    for name, variable in at_603.variables.items():
        assert "units" in variable.attrs, name
    for name in set(at_603.data_vars) - exact:
        if not name.endswith("_error"):
            assert f"{shared.get(name, name)}_error" in at_603, name
    assert at_603.attrs["version"] == kc.__version__ and at_603.attrs["engine"] == "auto"
    assert json.loads(at_603.attrs["scene"])["spin"] == 0.999


def test_a_sweep_fits_into_one_netcdf_file(at_603, tmp_path):
    at_603.to_netcdf(tmp_path / "sweep.nc", engine="h5netcdf")
    assert xarray.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf").identical(at_603)


def test_area_of_the_critical_curves_of_schwarzschild():
    """Rings at the angles that another program found, to 1e-6 degrees."""
    scene = Scene(0.0, 6.03, velocity="static", orders=3, compute=("areas",))
    found = computed(scene, 0.0, 6.03, 90.0)
    ring = 2 * math.pi * (1 - np.cos(np.radians([61.686934, 45.422610, 44.813239])))
    assert (np.abs(found["critical_area"] - ring) <= found["critical_area_error"] + 5e-8).all()
    assert (found["critical_area_error"] < 1e-6).all()
    # Every caustic is a point.
    assert (found["caustic_area"] <= found["caustic_area_error"]).all() and (found["caustic_area_error"] < 1e-15).all()


@pytest.mark.parametrize(
    "place", [(0.999, 6.03, 90.0), (0.9, 1.6, 90.0), pytest.param((0.9, 4.0, 11.5), marks=pytest.mark.slow)]
)
def test_error_of_areas_is_honest(place):
    """Against polygons of many more points, on splines of degree 7."""
    spin, radius, inclination = place
    found = computed(Scene(spin, radius, orders=2, compute=("areas",)), *place)
    camera = kc.Camera(spin, radius, math.radians(inclination))
    dark = kc.shadow_edge(camera, 2000)
    for i, caustic in enumerate(kc.caustics(camera, 2)):
        points = np.hstack([caustic.sky, caustic.celestial])
        points = np.vstack([points, points[:1]])
        arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)))
        dense = make_interp_spline(arc, points, k=7, bc_type="periodic")(np.linspace(0, arc[-1], 400 * len(arc)))
        area = abs(np.trapezoid(-np.cos(dense[:, 3]), dense[:, 4]))
        assert abs(found["caustic_area"][i] - area) <= found["caustic_area_error"][i] < 2e-6 * area
        solid = solid_angle(dense[:, :3] / np.linalg.norm(dense[:, :3], axis=1)[:, None])
        assert abs(found["critical_area"][i] - solid) <= found["critical_area_error"][i] < 1e-6 * solid
    # That of the shadow, which lies inside, was measured by another way in the test of the magnification.
    assert found["critical_area"][0] > found["critical_area"][1] > solid_angle(dark)


def solid_angle(curve):
    """Inside a closed curve of directions, from triangles about its middle."""
    following = np.roll(curve, -1, axis=0)
    middle = np.cross(curve, following).sum(axis=0)
    middle /= np.linalg.norm(middle)
    below = 1 + (curve * following).sum(axis=1) + curve @ middle + following @ middle
    return abs(2 * np.arctan2(np.cross(curve, following) @ middle, below).sum())


def test_error_of_the_magnification_is_honest():
    few, many = (
        computed(Scene(0.9, 6.0, compute=("magnification",), directions=n), 0.9, 6.0, 90.0) for n in (512, 16384)
    )
    dark = solid_angle(kc.shadow_edge(kc.Camera(0.9, 6.0), 2000)) / (4 * math.pi)
    for found in (few, many):
        assert abs(1 - found["escaping"] - dark) <= found["escaping_error"] + 1e-4
    doubt = few["magnification_error"] + many["magnification_error"]
    assert (np.abs(few["magnification"] - many["magnification"]) <= doubt).all()
    assert (doubt < 0.3 * many["magnification"]).all() and (np.diff(many["magnification"]) > 0).all()
