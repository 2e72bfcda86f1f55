"""Shifts of light with a spectrum: against black bodies, power laws in closed form, and what must vanish."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.colour import luminance, shift_of, shifted_light

RATIOS = np.array([0.4, 0.7, 1.0, 1.3, 2.5])
SWITCHES = [(beaming, colour_shift) for beaming in (False, True) for colour_shift in (False, True)]


def table_of(power, ends=(100.0, 5000.0)):
    wavelength = np.geomspace(*ends, 4000)
    return np.column_stack([wavelength, power(wavelength)])


def planck(kelvin):
    return lambda nm: nm**-5 / np.expm1(1.438776877e7 / (nm * kelvin))


@pytest.mark.parametrize("switches", SWITCHES)
@pytest.mark.parametrize("kelvin", [3000.0, 6504.0, 12000.0])
def test_a_table_of_a_black_body_shifts_as_one(kelvin, switches):
    wanted = shifted_light(RATIOS, *switches, kelvin)
    assert shift_of(table_of(planck(kelvin)))(RATIOS, *switches) == pytest.approx(wanted, rel=5e-3)
    if kelvin == 6504.0:
        assert np.array_equal(shift_of(None)(RATIOS, *switches), wanted)


@pytest.mark.parametrize("exponent", [-2.0, -0.7, 0.0, 2.0])
def test_a_power_law_stays_one(exponent):
    """S_lambda goes as lambda^(-2 - alpha): its table, and the closed form."""
    table = shift_of(table_of(lambda nm: (nm / 500) ** (-2 - exponent)))
    factor = RATIOS[:, None] ** (3 - exponent) * np.ones(3)
    for shift in (table, shift_of(exponent)):
        assert shift(RATIOS, True, True) == pytest.approx(factor, rel=1e-3)
        assert shift(RATIOS, False, True) == pytest.approx(1, rel=1e-3)
        assert shift(RATIOS, True, False) == pytest.approx(RATIOS[:, None] ** 4 * np.ones(3), rel=1e-12)


def test_each_channel_may_have_a_power_law():
    shift = shift_of([0.0, 1.0, 2.0])
    assert shift(np.array([2.0]), True, True) == pytest.approx(np.array([[8.0, 4, 2]]))
    kept = shift(np.array([2.0]), False, True)
    assert kept[0, 0] / kept[0, 2] == pytest.approx(4) and luminance(kept) == pytest.approx(1)


def test_light_moves_along_its_table():
    """A green band is red where it is shifted by 530 / 620; beyond the ends of the table there is nothing."""
    bump = shift_of(table_of(lambda nm: 1e-3 + np.exp(-(((nm - 530) / 30) ** 2)), (300.0, 1000.0)))
    red, green, _ = bump(np.array(530 / 620), False, True)
    assert red > 3 > 0.3 > green
    for beaming in (False, True):
        assert not bump(np.array([3.0, 0.3]), beaming, True).any()


@pytest.mark.parametrize("beaming", [False, True])
def test_a_picture_shifts_by_its_spectrum(beaming):
    n, ones = np.array([[0.6, 0.0, 0.8]]), np.ones(1)
    seen = kc.skies.Footprint(n, 0.1 * np.eye(2)[None], 0 * ones, 1.5 * ones)
    light = 0.3 * np.ones((16, 32, 3))
    plain = kc.skies.Panorama(light, spectrum=-0.7).light(seen, beaming, True)
    assert plain == pytest.approx(0.3 * (1.5**3.7 if beaming else 1), rel=1e-5)
    around = kc.skies.StarField(band=0, nebulae=kc.skies.Panorama(light, spectrum=-0.7))
    assert around.light(seen, beaming, True) == pytest.approx(plain)


@pytest.mark.parametrize(
    "spectrum",
    ["red", math.nan, [1.0, 2.0], [[500.0, 1.0]], [[500, 1], [400, 1]], [[400, 1], [500, -1]], [[0.5, 1], [500, 1]]],
)
def test_what_is_no_spectrum_is_refused(spectrum):
    with pytest.raises(ValueError, match="Argument `spectrum` must"):
        kc.skies.Panorama(np.ones((8, 16, 3)), spectrum=spectrum)


def test_a_spectrum_that_nobody_sees_is_refused():
    with pytest.raises(ValueError, match="Argument `spectrum` must have light between 360 and 830 nm"):
        kc.skies.Panorama(np.ones((8, 16, 3)), spectrum=[[1000, 1], [2000, 1]])
