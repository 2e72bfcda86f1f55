"""Polynomials of the kernels' elementary functions: writes kerrcaustics/beams/kernels/coefficients.h.

    python -m studies.truth.elementary_functions

Each polynomial has the least largest error of its degree (Remez' exchange, 40 digits), in units of the function that
it serves; its coefficients are then rounded to doubles, and the error is measured again. The constants of the
reductions (pi / 2, ln 2 and atan(1/2) in parts, the first guess of the cube root) are computed here too.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mpmath import mp, mpf

OUTPUT = Path(__file__).parents[2] / "kerrcaustics" / "beams" / "kernels" / "coefficients.h"
DIGITS = 40
# Points at which errors are sampled: enough for a dozen extrema.
SAMPLES = 600
EXCHANGES = 12
# Added to weights that vanish with the argument, so that the first coefficient is known well too.
LEAST_WEIGHT = mpf(2) ** -12
# Relative width that the rounding of a reduction may add to an interval.
MARGIN = mpf(2) ** -20

Function = Callable[[mpf], mpf]


@dataclass(frozen=True)
class Fit:
    """One polynomial, and the function that it serves."""

    # Name of the array of coefficients, ascending.
    name: str
    # The sentence that stands in the header.
    about: str
    # Function that the polynomial approximates.
    function: Function
    # Error of the result, relative, for an error 1 of the polynomial.
    weight: Function
    # The interval of its argument.
    ends: tuple[mpf, mpf]
    degree: int


def samples(ends: tuple[mpf, mpf], count: int = SAMPLES) -> list[mpf]:
    """Points of an interval, dense towards its ends as extrema are."""
    low, high = ends
    return [(low + high) / 2 - (high - low) / 2 * mp.cos(mp.pi * i / count) for i in range(count + 1)]


def extrema(errors: list[mpf], count: int) -> list[int]:
    """Indices of the largest errors of alternating sign."""
    runs: list[int] = []
    for i, error in enumerate(errors):
        if runs and error * errors[runs[-1]] > 0:
            runs[-1] = max(runs[-1], i, key=lambda j: abs(errors[j]))
        else:
            runs.append(i)
    while len(runs) > count:
        runs.pop(0 if abs(errors[runs[0]]) < abs(errors[runs[-1]]) else -1)
    return runs


def minimax(fit: Fit) -> list[mpf]:
    """Coefficients, ascending, of the polynomial of least largest weighted error."""
    points = samples(fit.ends)
    values, weights = [fit.function(x) for x in points], [fit.weight(x) + LEAST_WEIGHT for x in points]
    count = fit.degree + 2
    chosen = [round((i + 0.5) * SAMPLES / count) for i in range(count)]
    for _ in range(EXCHANGES):
        # The error at the chosen points is alternately + and -.
        rows = [[points[i] ** k for k in range(count - 1)] + [(-1) ** j / weights[i]] for j, i in enumerate(chosen)]
        solution = list(mp.lu_solve(mp.matrix(rows), mp.matrix([values[i] for i in chosen])))[:-1]
        errors = [w * (mp.polyval(solution, x, asc=True) - v) for x, v, w in zip(points, values, weights, strict=True)]
        following = extrema(errors, count)
        if following == chosen or len(following) < count:
            break
        chosen = following
    return solution


def largest_error(fit: Fit, coefficients: list[float]) -> mpf:
    """Largest weighted error of rounded coefficients."""
    exact = [mpf(c) for c in coefficients]
    points = samples(fit.ends, 2 * SAMPLES + 1)
    return max(abs(fit.weight(x) * (mp.polyval(exact, x, asc=True) - fit.function(x))) for x in points)


def with_limit(function: Function, limit: mpf) -> Function:
    """The function with its limit at 0, where its formula divides by zero, and more digits next to it."""

    def value(x: mpf) -> mpf:
        if x == 0:
            return limit
        with mp.workdps(3 * DIGITS):
            return function(x)

    return value


def parts(value: mpf, bits: int, count: int) -> list[float]:
    """A number as a sum: `count` parts of so many bits each, and the rest as a double."""
    rest, found = value, []
    unit = mpf(2) ** (mp.floor(mp.log(value, 2)) + 1 - bits)
    for i in range(count):
        found.append(mp.floor(rest / unit) * unit)
        rest -= found[i]
        unit *= mpf(2) ** -bits
    return [float(x) for x in (*found, rest)]


def inverse_cube_root_guess(high_word: int, constant: int) -> tuple[mpf, mpf]:
    """A number by the upper half of its bits, and the guess of its inverse cube root that the kernels make."""

    def double(upper: int) -> mpf:
        return mpf(struct.unpack("<d", struct.pack("<q", upper << 32))[0])

    return double(high_word), double(round(constant - high_word / 3))


def guess_range(constant: int) -> tuple[mpf, mpf]:
    """Least and largest 1 - a r^3 for the guess r of the inverse cube root of a, over three binades."""
    first, binade = 1023 << 20, 1 << 20
    pairs = [inverse_cube_root_guess(first + binade * i // 128, constant) for i in range(3 * 128)]
    defects = [1 - a * r**3 for a, r in pairs]
    return min(defects), max(defects)


def balanced_guess() -> tuple[int, mpf]:
    """The constant whose guesses are as often too large as too small, and the largest |1 - a r^3|."""
    low, high = ((4 * 1023 << 20) // 3 - (1 << 17)), (4 * 1023 << 20) // 3
    while high - low > 1:
        middle = (low + high) // 2
        least, largest = guess_range(middle)
        low, high = (middle, high) if largest > -least else (low, middle)
    return low, max(abs(x) for x in guess_range(low)) + mpf(2) ** -12


def fits(largest_defect: mpf) -> list[Fit]:
    """The polynomials; z is the square of the reduced argument."""
    quarter = (mp.pi / 4 * (1 + MARGIN)) ** 2
    half_log = mp.log(2) / 2 * (1 + MARGIN)
    slope = ((mp.sqrt(2) - 1) / (mp.sqrt(2) + 1) * (1 + MARGIN)) ** 2
    third = (mpf(1) / 3 * (1 + MARGIN)) ** 2
    root = mp.sqrt
    return [
        Fit(
            *("SINE", "sin(r) = r + r z p(z), |r| <= pi / 4"),
            with_limit(lambda z: (mp.sin(root(z)) / root(z) - 1) / z, mpf(-1) / 6),
            with_limit(lambda z: z * root(z) / mp.sin(root(z)), mpf(0)),
            *((mpf(0), quarter), 5),
        ),
        Fit(
            *("COSINE", "cos(r) = 1 - z / 2 + z^2 p(z), |r| <= pi / 4"),
            with_limit(lambda z: (mp.cos(root(z)) - 1 + z / 2) / z**2, mpf(1) / 24),
            lambda z: z**2 / mp.cos(root(z)),
            *((mpf(0), quarter), 5),
        ),
        Fit(
            *("ARC_TANGENT", "atan(t) = t + t z p(z), |t| <= 1 / 3"),
            with_limit(lambda z: (mp.atan(root(z)) / root(z) - 1) / z, mpf(-1) / 3),
            with_limit(lambda z: z * root(z) / mp.atan(root(z)), mpf(0)),
            *((mpf(0), third), 9),
        ),
        Fit(
            *("LOGARITHM", "ln((1 + s) / (1 - s)) = 2 s + s z p(z), |s| <= 0.1716"),
            with_limit(lambda z: (2 * mp.atanh(root(z)) / root(z) - 2) / z, mpf(2) / 3),
            with_limit(lambda z: z * root(z) / (2 * mp.atanh(root(z))), mpf(0)),
            *((mpf(0), slope), 6),
        ),
        Fit(
            *("EXPONENTIAL", "exp(r) = 1 + r + r^2 p(r), |r| <= ln(2) / 2"),
            with_limit(lambda r: (mp.exp(r) - 1 - r) / r**2, mpf(1) / 2),
            lambda r: r**2 / mp.exp(r),
            *((-half_log, half_log), 9),
        ),
        Fit(
            *("INVERSE_CUBE_ROOT", f"(1 - h)^(-1/3) = 1 + h p(h), |h| <= {mp.nstr(largest_defect, 3)}"),
            with_limit(lambda h: ((1 - h) ** (mpf(-1) / 3) - 1) / h, mpf(1) / 3),
            lambda h: abs(h) * (1 - h) ** (mpf(1) / 3),
            *((-largest_defect, largest_defect), 2),
        ),
    ]


def power_of_two(error: mpf) -> str:
    """An error as 2^x."""
    return f"2^{float(mp.log(error, 2)):.1f}"


def array(fit: Fit) -> str:
    """The lines of one polynomial."""
    coefficients = [float(c) for c in minimax(fit)]
    error = largest_error(fit, coefficients)
    numbers = "".join(f"    {c.hex()},\n" for c in coefficients)
    return (
        f"// {fit.about}; degree {fit.degree}, largest relative error {power_of_two(error)}.\n"
        f"constexpr double {fit.name}[] = {{\n{numbers}}};\n"
    )


def constants(guess: int) -> str:
    """The lines of the constants of the reductions."""
    half_pi, half_pi_middle, half_pi_low = parts(mp.pi / 2, 36, 2)
    turn, turn_low = parts(mp.pi / 2, 33, 1)
    half, half_low = parts(mp.atan(mpf(1) / 2), 31, 1)
    ln2, ln2_low = parts(mp.log(2), 40, 1)
    groups = [
        ("2 / pi.", {"TWO_OVER_PI": float(2 / mp.pi)}),
        (
            "pi / 2 in three parts: products of the first two with integers below 2^17 are exact.",
            {"HALF_PI_HIGH": half_pi, "HALF_PI_MIDDLE": half_pi_middle, "HALF_PI_LOW": half_pi_low},
        ),
        (
            "pi / 2 and atan(1/2) in two parts: sums of multiples of the first parts are exact.",
            {"RIGHT_ANGLE": turn, "RIGHT_ANGLE_LOW": turn_low, "ATAN_HALF": half, "ATAN_HALF_LOW": half_low},
        ),
        (
            "1 / ln(2), and ln(2) in two parts: products of the first with exponents are exact.",
            {"ONE_OVER_LN2": float(1 / mp.log(2)), "LN2_HIGH": ln2, "LN2_LOW": ln2_low},
        ),
        (
            "The upper 32 bits of a^(-1/3) are about this number less a third of those of a.",
            {"INVERSE_CUBE_ROOT_GUESS": float(guess)},
        ),
    ]
    lines = []
    for about, numbers in groups:
        lines += [f"// {about}", *(f"constexpr double {name} = {x.hex()};" for name, x in numbers.items())]
    return "\n".join(lines) + "\n"


def header() -> str:
    """The text of coefficients.h."""
    with mp.workdps(DIGITS):
        guess, defect = balanced_guess()
        about = (
            "// Coefficients of the elementary functions. Written by `python -m studies.truth.elementary_functions`."
        )
        return "\n".join([f"{about}\n#pragma once\n", constants(guess), *map(array, fits(defect))])


def main() -> None:
    """Write the header."""
    OUTPUT.write_text(header(), encoding="utf-8")


if __name__ == "__main__":
    main()
