"""Light of discs that are not uniform, from areas in closed form: with kinks, and profiles with steps."""

import math
from itertools import pairwise

import numpy as np
import pytest

from kerrcaustics.extended_sources.nested_discs import RoundSource, integrated, radii_for
from kerrcaustics.extended_sources.profiles import checked_profile


def covering(away):
    """The kink of an area where the limb of a disc covers a fold."""
    return away * np.log(np.abs(away) + 1e-300)


# Radii at which a caustic is touched, and areas of images by the radius of the disc.
AREAS = {
    "smooth": ((), lambda s: s**2 + s**4 / 7),
    "fold at the centre": ((0.0,), lambda s: s**2 + s**1.5),
    "cusp at the centre": ((0.0,), lambda s: s**2 + 0.05 * s ** (4 / 3)),
    "enters a caustic": ((0.37,), lambda s: s**2 + 2 * np.maximum(s - 0.37, 0)),
    "covers a fold": ((0.37, 0.8), lambda s: s**2 - (covering(s - 0.37) - covering(-0.37)) / 3),
    "touches a fold": ((1.0,), lambda s: s**2 - (covering(1.003 - s) - covering(1.003)) / 10),
}
PROFILES = {
    "linear": ("linear", 0.6),
    "gaussian": ("gaussian", 0.2),
    "steep": lambda s: 1 / (1 + np.exp((s - 0.5) / 0.02)),
    "step": lambda s: np.where(s < 0.61, 1.0, 0.25),
    "narrow ring": lambda s: np.exp(-(((s - 0.7) / 0.01) ** 2)),
}


def light(area, brightness, radii):
    """The integral of the intensity with dA, by 20,000 rings that crowd at kinks and steps."""
    part = np.sin(math.pi / 2 * np.linspace(0, 1, 20_001)) ** 3
    ends = np.unique([0.0, *radii, 0.61, 1.0])
    s = np.unique(np.concatenate([low + (high - low) * part for low, high in pairwise(ends)]))
    return (brightness.intensity(np.arcsin((s[1:] + s[:-1]) / 2)) * np.diff(area(s))).sum()


@pytest.mark.parametrize("kind", AREAS)
def test_errors_of_the_sum_over_radii_are_honest_and_small(kind):
    radii, area = AREAS[kind]
    whole, discs = area(1.0), []
    for name, profile in PROFILES.items():
        brightness = checked_profile(profile)
        source, exact = RoundSource(1.0, True, brightness), light(area, brightness, radii)
        for wanted in (0.1, 1e-3, 1e-6):
            taken = []
            (total,), (error,) = integrated(
                lambda x, taken=taken: (np.array([area(taken.append(x) or math.sin(x))]), np.zeros(1)),
                (np.array([whole]), np.zeros(1)),
                source,
                np.arcsin(np.array(radii)),
                np.array([wanted]),
                radii_for(wanted),
            )
            # The rings are good to 3e-8.
            assert abs(total - exact) < error + 3e-8 * total, (name, wanted)
            assert 0 < error <= wanted, (name, wanted)
            discs.append(len(taken))
    # The looser the tolerance, the fewer discs.
    by_tolerance = np.sum(np.reshape(discs, (len(PROFILES), -1)), axis=0)
    assert (np.diff(by_tolerance) > 0).all()


def test_errors_of_areas_enter_by_the_steps_of_the_profile():
    source = RoundSource(1e-3, False, checked_profile(PROFILES["step"]))
    of_disc = 4 * math.pi * math.sin(5e-4) ** 2
    assert source.light == pytest.approx(of_disc / 4 + 0.75 * 4 * math.pi * math.sin(3.05e-4) ** 2, rel=1e-9)

    def columns(x):
        area = source.area(np.array([x]))
        return 2 * area, 1e-3 * area

    (total,), (error,) = integrated(columns, columns(math.pi / 2), source, np.empty(0), np.array([1e-20]))
    assert total == pytest.approx(2 * source.light, rel=1e-9) and 1e-3 * source.light < error < 0.02 * source.light


def test_what_polynomials_miss_of_a_profile_enters():
    noise = np.random.default_rng(1)

    def columns(x):
        return np.array([math.sin(x) ** 2 + math.sin(x) ** 4]), np.zeros(1)

    means, errors = [], []
    for _ in range(3):
        source = RoundSource(1.0, True, checked_profile(lambda s: 1 + 0.1 * noise.random(s.shape)))
        (total,), (error,) = integrated(columns, columns(math.pi / 2), source, np.empty(0), np.array([1e-6]))
        means.append(total / source.light)
        errors.append(error / source.light)
    assert 1e-6 < np.ptp(means) < 2 * min(errors) < 0.2
