"""Precision of spin and inclination from the images of one star.

    kerrcaustics study fit

A camera at a known radius sees the images of index 0 and 1 of a star at a known place, each with the same Gaussian
error in both directions. Spin and inclination are fitted by least squares: images move with them as
`kc.functional.direction` says, and the derivatives are those of the implicit function theorem. The covariance of the
fit is compared with the scatter of many fits to images with other errors. Writes fit.json, .png and .md; the picture
shows the fits, and the ellipses of one and two standard errors.
"""

import math
import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from matplotlib import rc_context
from matplotlib.figure import Figure
from scipy.optimize import least_squares

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.spacetime.sphere import from_angles

QUESTION = "How well do images give spin and inclination?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 28
QUICK_SECONDS = 15

RADIUS = 20.0
TRUE = (0.7, math.radians(60.0))
"""Spin and inclination."""
STAR = (math.radians(80.0), math.radians(172.0))
NAMES = ("spin", "inclination (°)")
BLUR = 1e-4
DRAWS = 300

# From where the fits start, and Newton's steps to the images from where they were measured.
_START = np.array([0.1, -0.1])
_STEPS = 4


def direction(unknown: Array, sky: Array) -> Array:
    """n' for the camera that is fitted, at rest."""
    return kc.functional.direction(unknown[0], RADIUS, unknown[1], sky)


@jax.jit
def seen(unknown: Array, near: Array) -> tuple[Array, Array]:
    """N (3,) of the image of the star next to `near`, and its derivatives (3, 2)."""
    star = jnp.asarray(from_angles(*STAR))
    inverse = jnp.linalg.pinv(jax.jacfwd(direction, 1)(unknown, near), rtol=1e-6)
    sky = near
    for _ in range(_STEPS):
        sky = sky + inverse @ (star - direction(unknown, sky))
        sky = sky / jnp.linalg.norm(sky)
    by_unknown, by_sky = jax.jacfwd(direction, (0, 1))(unknown, sky)
    return sky, jnp.linalg.pinv(by_sky, rtol=1e-6) @ -by_unknown


def fitted(measured: np.ndarray, blur: float) -> tuple[np.ndarray, np.ndarray]:
    """The unknowns that fit measured places N (images, 3) best, and their covariance (2, 2)."""
    basis = np.stack(kc.tangent_basis(measured), axis=1)

    def model(unknown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sky, slopes = (np.asarray(x) for x in jax.vmap(seen, (None, 0))(unknown, measured))
        return (basis @ (sky - measured)[:, :, None] / blur).ravel(), (basis @ slopes / blur).reshape(-1, 2)

    def residual(unknown: np.ndarray) -> np.ndarray:
        return model(unknown)[0]

    def slopes(unknown: np.ndarray) -> np.ndarray:
        return model(unknown)[1]

    start = np.array(TRUE) + _START
    found = least_squares(residual, start, slopes, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return found.x, np.linalg.inv(found.jac.T @ found.jac)


def blurred(sky: np.ndarray, blur: float, chance: np.random.Generator) -> np.ndarray:
    """Places as they are measured."""
    e_1, e_2 = kc.tangent_basis(sky)
    first, second = blur * chance.standard_normal((2, len(sky), 1))
    moved = sky + first * e_1 + second * e_2
    return moved / np.linalg.norm(moved, axis=1, keepdims=True)


def picture(fits: np.ndarray, covariance: np.ndarray) -> Figure:
    """Spin and inclination of all fits, and the ellipses of the covariance about the truth."""
    turn = np.linspace(0, 2 * np.pi, 200)
    circle = np.linalg.cholesky(covariance) @ np.stack([np.cos(turn), np.sin(turn)])
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH / 2, 3.2), layout="constrained")
        ax = figure.add_subplot()
        ax.plot(fits[:, 0], np.degrees(fits[:, 1]), ".", markersize=3, color=style.PALETTE[1], label="fits")
        for size in (1, 2):
            spin, inclination = TRUE[0] + size * circle[0], np.degrees(TRUE[1] + size * circle[1])
            ax.plot(spin, inclination, color="#333333", linewidth=0.9, label=None if size == 2 else "1σ, 2σ")
        ax.set(xlabel="spin", ylabel="inclination (°)")
        ax.legend()
    return figure


QUICK: dict[str, Any] = {"draws": 40}
"""Arguments of `main` for a quick run."""


def main(output: Path, draws: int = DRAWS, blur: float = BLUR) -> list[Path]:
    """Run the study; the files in `output`."""
    began = time.perf_counter()
    camera = kc.Camera(TRUE[0], RADIUS, TRUE[1], "fiducial")
    images = kc.star_images(camera, STAR, 1)
    chance = np.random.default_rng(17)
    with jax.enable_x64(True):
        best, covariance = fitted(images.sky, blur)
        fits = np.array([fitted(blurred(images.sky, blur, chance), blur)[0] for _ in range(draws)])
    away = fits - np.array(TRUE)
    mean_square = float(np.mean(np.einsum("ij,jk,ik->i", away, np.linalg.inv(covariance), away)))
    errors, scatter = np.sqrt(np.diag(covariance)), np.sqrt(np.mean(away**2, axis=0))
    units = (1, math.degrees(1))
    rows = [
        [name, f"{true * unit:.6g}", f"{error * unit:.3g}", f"{s * unit:.3g}"]
        for name, true, unit, error, s in zip(NAMES, TRUE, units, errors, scatter, strict=True)
    ]
    text = markdown_table(["", "true", "standard error", f"scatter of {draws} fits"], rows)
    print(text)
    correlation = covariance[0, 1] / (errors[0] * errors[1])
    findings = [
        f"{len(images)} images of one star, each measured to {blur:g} rad from r = {RADIUS:g}, give the spin to "
        f"{errors[0]:.2g} and the inclination to {math.degrees(errors[1]):.2g} degrees, with a correlation of "
        f"{correlation:.2f}.",
        f"The scatter of {draws} fits has a mean square of {mean_square:.2f} in units of the covariance (2 is due).",
        f"Without errors of measurement the fit returns the truth to {np.abs(best - TRUE).max():.1e}.",
    ]
    return write_study(
        output,
        "fit",
        __doc__ or "",
        picture(fits, covariance),
        text,
        settings={"spin": TRUE[0], "radius": RADIUS, "blur": blur, "draws": draws},
        findings=findings,
        unknowns=NAMES,
        covariance=covariance,
        standard_error=errors,
        scatter=scatter,
        mean_square=mean_square,
        fits=fits,
        seconds=time.perf_counter() - began,
    )
