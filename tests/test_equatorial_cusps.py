"""Cusps on the equator in long arithmetic, of the study orders, against numbers of another program."""

import math
from itertools import pairwise

import numpy as np
import pytest

from kerrcaustics.scripts import STUDIES

EquatorialCusps = STUDIES.module("orders.equatorial_cusps").EquatorialCusps


def test_cusps_on_the_equator_are_those_of_another_program():
    # a = 0.999, r = 6.03: ends in phi' of orders 1 to 4, degrees, unwrapped so that one curve closes.
    ends = {1: (167.4713, 48.128, -1426.497, -4727.458), -1: (167.9224, 311.146, 449.935, 588.533)}
    for side, expected in ends.items():
        cusps = EquatorialCusps(0.999, 6.03, side).cusps(4)
        found = [math.degrees(azimuth) + (360 * k if side > 0 else 0) for k, (_, azimuth) in enumerate(cusps, 1)]
        np.testing.assert_allclose(found, expected, atol=6e-4)
        assert all(later[0] < sooner[0] / 4 for sooner, later in pairwise(cusps))


def test_a_camera_among_the_photon_orbits_is_refused():
    with pytest.raises(ValueError, match="outside all photon orbits, but is 3"):
        EquatorialCusps(0.999, 3.0, 1)
