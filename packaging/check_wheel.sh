#!/usr/bin/env bash
# Builds a wheel, installs it into an environment of its own that sees the locked packages, but no compiler, and makes the
# demo and a figure in an empty folder, away from the checkout. A minute or two; needs the .venv of `make setup`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT

libraries() { "$1" -c 'import sysconfig; print(sysconfig.get_path("purelib"))'; }

.venv/bin/python -m hatchling build --target wheel --directory "$place/dist" >/dev/null
.venv/bin/python -m venv "$place/venv"
"$place/venv/bin/python" -m pip --disable-pip-version-check install --quiet --no-deps "$place"/dist/*.whl
libraries .venv/bin/python >"$(libraries "$place/venv/bin/python")/locked.pth"
# In the place of the compiler among the locked packages.
echo 'raise ImportError("an installed package compiles nothing")' >"$(libraries "$place/venv/bin/python")/ziglang.py"

mkdir "$place/empty"
cd "$place/empty"
unset PYTHONPATH
"$place/venv/bin/python" -c "
import glob, os.path
import kerrcaustics, kerrcaustics.scripts as scripts
assert kerrcaustics.__file__.startswith('$place'), kerrcaustics.__file__
home = os.path.dirname(kerrcaustics.__file__)
assert all(os.path.isfile(os.path.join(home, name)) for name in ('py.typed', '__init__.pyi', 'skies.pyi'))
kernels = os.path.join(home, 'beams', 'kernels', 'objects')
assert glob.glob(os.path.join(kernels, 'kernels-*.so')) or glob.glob(os.path.join(kernels, 'kernels-*.dylib'))
assert all(os.path.isfile(os.path.join(kernels, f'kernels-{build}.wasm')) for build in ('simd', 'plain'))
assert os.path.isfile(os.path.join(home, 'explorer', 'page', 'states.xz'))
assert all(found.names() for found in (scripts.FIGURES, scripts.STUDIES, scripts.FILMS))
assert scripts.FILMS.load('pair_creation').film(4)"
"$place/venv/bin/kerrcaustics" demo >/dev/null
test -s demo/caustics_a0.999_r6.03.png
# The page is a copy: its states come with the wheel, and nothing is computed.
test -s demo/explorer.html
timeout 20 "$place/venv/bin/kerrcaustics" explore --page page.html >/dev/null
cmp demo/explorer.html page.html
"$place/venv/bin/kerrcaustics" figures camera_and_sky >/dev/null
test -s kerrcaustics-figures/camera_and_sky.png
