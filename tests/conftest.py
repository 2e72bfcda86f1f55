"""What holds for all tests: inside the engines types and shapes are checked at run time."""

from jaxtyping import install_import_hook

# All but what a caller meets: modules that refuse what is wrong themselves, in words, and results.
SPACETIME = ("cubic", "elliptic", "kerr", "polar", "radial", "sphere")
BEAMS = ("calls", "choice", "closed_form", "emitters", "errors", "geometry", "integrator", "ray_end")
CHECKED = [f"kerrcaustics.spacetime.{name}" for name in SPACETIME] + [f"kerrcaustics.beams.{name}" for name in BEAMS]


def pytest_configure(config):
    """Before the package is imported; benchmarks time it as users have it."""
    if not config.getoption("benchmark_only", default=False):
        install_import_hook(CHECKED, "typed.checked")
