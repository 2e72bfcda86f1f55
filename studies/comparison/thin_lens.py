"""A point mass as codes for thin lenses have it, and the hole itself: where they agree, and from which distance on.

    .venv/bin/python -m studies.comparison.thin_lens

An observer at the radius r sees a source on the sphere of the radius 2 r, at u Einstein radii from the line through the
hole. Thin lenses bend light by 4 M / b at the impact parameter b; the next term is 15 pi / 16 M / b times as large
(`second_term` of a lens). To first order in it, an image at theta, in Einstein radii, moves outward by
second_term / (theta^2 + 1), and both images change the signed magnification by -second_term / (u^2 + 4)^(3/2): the sum
of their brightnesses stays. What is left falls as 1 / b^2, that is as 1 / r.

VBMicrolensing and lenstronomy are packages of PyPI (`pip install vbmicrolensing lenstronomy`); where one is absent, it
is skipped with its reason. Times are medians of five; a first call, which searches the sky once, is not counted.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ellipe, ellipk, elliprf, elliprj

import kerrcaustics as kc

from .measure import timed

Array = np.ndarray

RADII = (1e3, 1e5, 1e7, 1e9)
FARTHER = 2.0  # radius of the source in radii of the observer
OFFSETS = (0.1, 0.5, 2.0)
# Distance of the centre from the caustic, and radius; the caustic lies within the source, on its limb or outside.
DISCS = ((0.0, 0.1), (0.05, 0.1), (0.1, 0.1), (0.5, 0.1), (0.3, 1.0), (2.0, 0.5))
SPIN = 0.9
CALLS = 1000


class Lens(NamedTuple):
    """A hole with its observer and the sphere of its sources.

    einstein: the Einstein radius, an angle at the observer; far: distance of the source in radii of its sphere.
    """

    observer: kc.Observer
    sphere: float
    einstein: float
    far: float

    @property
    def impact(self) -> float:
        """Impact parameter of the Einstein ring."""
        return self.einstein * self.observer.radius

    @property
    def second_term(self) -> float:
        """Second term of the deflection at the Einstein ring, relative to the first."""
        return 15 * math.pi / 16 / self.impact

    def place(self, u: float) -> tuple[float, float]:
        """Of a source at u Einstein radii."""
        return math.pi / 2, math.pi - u * self.einstein * self.far

    def per_flat(self, magnification: Array) -> Array:
        """Ratios of solid angles at the observer, of magnifications in the units of its screen."""
        return magnification / self.observer.radius**2 * self.far**2


class Images(NamedTuple):
    """Two images, of index 0 and 1: places in Einstein radii from the hole, signed, and brightness."""

    place: Array
    magnification: Array


def lens_at(radius: float, spin: float = 0.0) -> Lens:
    """A lens on whose equator the observer is."""
    sphere = FARTHER * radius
    einstein = math.sqrt(4 * sphere / (radius * (radius + sphere)))
    observer = kc.Observer(spin=spin, inclination=math.pi / 2, radius=radius)
    return Lens(observer, sphere, einstein, (radius + sphere) / sphere)


def hole_images(lens: Lens, u: float) -> Images:
    """The two bright images of a point."""
    seen = kc.star_images(lens.observer, lens.place(u), 1, end=lens.sphere)
    assert seen.certified and seen.per_index == {0: 1, 1: 1}, seen.remarks
    order = np.argsort(seen.index)
    angle = 2 * np.arctan(np.hypot(*seen.sky[order].T) / (2 * lens.observer.radius))
    return Images(angle * [1, -1] / lens.einstein, lens.per_flat(seen.magnification[order]))


def thin_images(u: float) -> Images:
    """The same of a thin lens, in closed form."""
    place = (u + np.array([1, -1]) * math.sqrt(u * u + 4)) / 2
    return Images(place, np.abs(1 / (1 - place**-4.0)))


def first_order(lens: Lens, u: float) -> Images:
    """What the second term of the deflection adds to them, to first order."""
    away = np.array([1, -1])
    shift = away / (thin_images(u).place ** 2 + 1)
    return Images(lens.second_term * shift, -lens.second_term * away / (u * u + 4) ** 1.5)


def hole_disc(lens: Lens, u: float, rho: float) -> float:
    """Magnification of a uniform disc of the radius rho at u, both in Einstein radii."""
    size = rho * lens.einstein * (lens.observer.radius + lens.sphere)
    seen = kc.magnification(lens.observer, lens.place(u), size, max_index=1, end=lens.sphere)
    assert seen.certified, seen.remarks
    return float(lens.per_flat(np.array(seen.total)))


def thin_disc(u: float, rho: float) -> float:
    """The same of a thin lens (Witt & Mao 1994, ApJ 430, 505)."""
    if u == rho:
        return (2 / rho + (1 + rho**2) / rho**2 * (math.pi / 2 + math.asin((rho**2 - 1) / (rho**2 + 1)))) / math.pi
    gap, ends = u - rho, u + rho
    side = math.sqrt(4 + gap**2)
    n = 4 * u * rho / ends**2
    m = 4 * n / side**2
    third_kind = elliprf(0, 1 - m, 1) + n / 3 * elliprj(0, 1 - m, 1, 1 - n)
    first = ends * side * ellipe(m) - gap * (8 + u * u - rho * rho) / side * ellipk(m)
    return float(first + 4 * gap**2 / ends * (1 + rho**2) / side * third_kind) / (2 * math.pi * rho**2)


def lenstronomy_images(u: float) -> Images:
    """The same images by lenstronomy, which searches a grid for them."""
    from lenstronomy.LensModel.lens_model import LensModel
    from lenstronomy.LensModel.Solver.lens_equation_solver import LensEquationSolver

    lens, of = LensModel(["POINT_MASS"]), [{"theta_E": 1.0, "center_x": 0.0, "center_y": 0.0}]
    options = {"min_distance": 0.07, "search_window": 5.3, "precision_limit": 1e-12, "num_iter_max": 100}
    x, y = LensEquationSolver(lens).image_position_from_source(u, 0.0, of, **options)
    return Images(x, np.abs(lens.magnification(x, y, of)))


def micro_lens() -> Any:
    """VBMicrolensing with its settings as they come."""
    from VBMicrolensing import VBMicrolensing

    return VBMicrolensing()


def compare_points() -> None:
    """Places and magnifications of the two images, and the sum of the magnifications, by radius."""
    for u in OFFSETS:
        thin = thin_images(u)
        for radius, lens in zip(RADII, map(lens_at, RADII), strict=True):
            seen, expected = hole_images(lens, u), first_order(lens, u)
            place, light = seen.place - thin.place, seen.magnification - thin.magnification
            print(
                f"point at u = {u:g}, r = {radius:g}, b = {lens.impact:.4g}: places differ by {place[0]:.3e} and "
                f"{place[1]:.3e}, {np.abs(place / expected.place - 1).max():.0e} from theory; magnifications by "
                f"{light[0]:.3e} and {light[1]:.3e}, {np.abs(light / expected.magnification - 1).max():.0e} from it; "
                f"their sum by {light.sum():.3e} = {light.sum() * lens.impact**2:.3f} / b^2",
                flush=True,
            )


def compare_discs() -> None:
    """Magnifications of discs by radius, relative to the thin lens."""
    for u, rho in DISCS:
        thin = thin_disc(u, rho)
        rows = [(hole_disc(lens, u, rho) / thin - 1, lens.impact**2) for lens in map(lens_at, RADII)]
        text = ", ".join(f"{away:.1e} = {away * scale:.2f} / b^2" for away, scale in rows)
        print(f"disc, u = {u:g}, rho = {rho:g}, {thin:.6f}: differs at r = {RADII} by {text}", flush=True)


def compare_spin() -> None:
    """The sum of two magnifications with spin: beside a thin lens behind the hole, and beside one moved by a."""
    u = OFFSETS[1]
    for radius in RADII:
        lens = lens_at(radius, SPIN)
        total = hole_images(lens, u).magnification.sum()
        moved = u - SPIN / lens.impact
        here, there = (total / thin_images(at).magnification.sum() - 1 for at in (u, moved))
        print(
            f"a = {SPIN}, u = {u:g}, r = {radius:g}: the sum differs by {here:.3e} = {here * lens.impact:.3f} / b, "
            f"from a lens moved by a by {there:.1e} = {there * lens.impact**2:.2f} / b^2",
            flush=True,
        )


def compare_distances() -> None:
    """From which radius on a thin lens is wrong by less than one per cent."""
    names = ("place of index 0", "place of index 1", "magnification of index 0", "of index 1", "their sum")
    powers = np.arange(1.5, 6.1, 0.25)
    for u in OFFSETS:
        thin = thin_images(u)
        seen = [hole_images(lens_at(10**power), u) for power in powers]
        ratios = [[*one.place / thin.place, *one.magnification / thin.magnification] for one in seen]
        sums = [[one.magnification.sum() / thin.magnification.sum()] for one in seen]
        wrong = np.log10(np.abs(np.hstack([ratios, sums]) - 1))
        for name, values in zip(names, wrong.T, strict=True):
            # Differences may change sign on the way in.
            last = int(np.flatnonzero(values > -2)[-1]) if (values > -2).any() else -1
            power = np.interp(2, -values[last : last + 2], powers[last : last + 2]) if last >= 0 else powers[0]
            print(f"u = {u:g}: wrong by less than 1 % beyond r = {10**power:.2g}, {name}", flush=True)


def compare_lenstronomy() -> None:
    """lenstronomy beside the closed form, and its time."""
    try:
        for u in OFFSETS:
            (found, seconds), thin = timed(lambda u=u: lenstronomy_images(u)), thin_images(u)
            away = (np.abs(one / other - 1).max() for one, other in zip(found, thin, strict=True))
            text = " and ".join(f"{value:.0e}" for value in away)
            print(f"lenstronomy at u = {u:g}: {text} from the closed form, {seconds * 1e3:.2f} ms", flush=True)
    except ImportError as error:
        print(f"lenstronomy: skipped, {error}")


def compare_micro_lens() -> None:
    """VBMicrolensing beside the elliptic integrals, and its time."""
    try:
        lens = micro_lens()
    except ImportError as error:
        print(f"VBMicrolensing: skipped, {error}")
        return
    for u, rho in DISCS:
        values, seconds = timed(lambda u=u, rho=rho: [lens.ESPLMag2(u, rho) for _ in range(CALLS)])
        thin = thin_disc(u, rho)
        print(
            f"VBMicrolensing at u = {u:g}, rho = {rho:g}: ESPLMag2 {values[0] / thin - 1:.1e}, ESPLMag "
            f"{lens.ESPLMag(u, rho) / thin - 1:.1e} from the elliptic integrals, {seconds / CALLS * 1e6:.2f} us"
        )
    drawn = np.random.default_rng(1).uniform((0, -3), (3, 0.5), (10 * CALLS, 2))
    away = np.abs([lens.ESPLMag2(u, 10**power) / thin_disc(u, 10**power) - 1 for u, power in drawn])
    print(f"VBMicrolensing, {len(away)} random discs: {np.median(away):.1e} in the median, {away.max():.1e} at most")


def measure_times() -> None:
    """Times of this package for one value more, and of the elliptic integrals."""
    lens = lens_at(RADII[2])
    for u in OFFSETS:
        print(f"kerrcaustics, point at u = {u:g}: {timed(lambda u=u: hole_images(lens, u))[1] * 1e3:.1f} ms")
    for u, rho in DISCS:
        ours, thin = (
            timed(lambda f=f, u=u, rho=rho: f(u, rho))[1] for f in (lambda *disc: hole_disc(lens, *disc), thin_disc)
        )
        print(f"kerrcaustics, u = {u:g}, rho = {rho:g}: {ours * 1e3:.0f} ms; elliptic integrals {thin * 1e6:.0f} us")


def main() -> None:
    """All comparisons."""
    compare_points()
    compare_discs()
    compare_spin()
    compare_distances()
    compare_lenstronomy()
    compare_micro_lens()
    measure_times()


if __name__ == "__main__":
    main()
