#!/usr/bin/env bash
# Builds source and wheel, and tries the wheel in clean environments: alone, with each extra, with the oldest and the
# newest dependencies, with the oldest and the newest Python that is here. In each it makes the demo and a smoke test,
# in an empty folder. Wheels of other platforms are built, and looked at alone. What cannot be tried is said. Some
# minutes; needs uv and the network, no compiler, nothing of .venv.
#
#   packaging/check.sh                  # all
#   packaging/check.sh plain            # only environments whose name begins so
#   packaging/check.sh --dist dist      # all, with the source and the wheels of that folder, which are to be published
set -euo pipefail
dist=
if [ "${1:-}" = --dist ]; then
    dist=$(cd "${2:?the folder with source and wheels is missing}" && pwd)
    shift 2
fi
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
only=${1:-}
extras=(space catalogues exr astro films explore notebook sweep inference)

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
unset PYTHONPATH
failed=0

say() { printf '== %s\n' "$*"; }

command -v uv >/dev/null || { say "No uv here: nothing can be tried" >&2; exit 1; }

# The interpreter of a version that is installed, pyenv's too; nothing where there is none.
python_of() {
    uv python find --offline --no-project --no-python-downloads "$1" 2>/dev/null ||
        ls -d "${PYENV_ROOT:-$HOME/.pyenv}/versions/$1".*/bin/python 2>/dev/null | tail -n 1 || true
}

# attempt NAME PYTHON WHAT... : the wheel in an environment of its own.
attempt() {
    local name=$1 python=$2 env=$place/$1
    shift 2
    [[ $name == "$only"* ]] || return 0
    uv venv --quiet --no-project --python "$python" "$env"
    if ! uv pip install --quiet --python "$env/bin/python" "$@"; then
        say "$name: FAILED to install"; failed=1; return 0
    fi
    mkdir "$env/empty"
    local began=$SECONDS size
    size=$(du -sm "$env" | cut -f 1)
    if (cd "$env/empty" && timeout 150 "$env/bin/kerrcaustics" demo >demo.txt &&
        "$env/bin/python" "$root/packaging/smoke.py" "${name#extra-}") >"$env/log" 2>&1; then
        say "$name: good; $("$env/bin/python" --version), $size MB, $((SECONDS - began)) s: $(tail -n 1 "$env/log")"
    else
        say "$name: FAILED"; tail -n 20 "$env/log"; failed=1
    fi
    rm -rf "$env"
}

say "$(uv --version)"
source=$place/source own=
if [ -n "$dist" ]; then
    source=$dist wheels=$dist
    [ "$(uname)" = Darwin ] && own=macosx*$(uname -m) || own=manylinux*$(uname -m)
else
    say "Building source and wheel"
    uv tool run --quiet --from build pyproject-build --installer uv --outdir "$source" . >"$place/build.txt" 2>&1 ||
        { cat "$place/build.txt"; exit 1; }
    wheels=$place/wheels
    [ -n "$only" ] || packaging/build_wheels.sh "$wheels" || failed=1
fi
ls "$source"
wheel=$(echo "$source"/*$own.whl)
uv tool run --quiet twine check --strict "$source"/* $(ls "$wheels"/* 2>/dev/null) || failed=1

oldest=$(python_of 3.11)
newest=
for version in 3.14 3.13 3.12; do
    [ -n "$newest" ] || newest=$(python_of "$version")
    [ -n "$(python_of "$version")" ] || say "Python $version: skipped, not installed here"
done
if [ -n "$oldest" ]; then
    attempt plain "$oldest" "$wheel"
    # Where the wheels were there already, none has been built from the source.
    [ -z "$dist" ] || attempt from-source "$oldest" "$dist"/*.tar.gz
    attempt oldest "$oldest" "$wheel" --constraints requirements-oldest.lock
    for extra in "${extras[@]}"; do
        attempt "extra-$extra" "$oldest" "$wheel[$extra]"
    done
    all=$(IFS=,; echo "${extras[*]}")
    attempt all "$oldest" "$wheel[$all]"
    attempt all-oldest "$oldest" "$wheel[$all]" --constraints requirements-oldest.lock
else
    say "Python 3.11: skipped, not installed here"
fi
[ -z "$newest" ] || attempt newest-python "$newest" "$wheel"
say "macOS: $([ "$(uname)" = Darwin ] && echo tried || echo "skipped, this is $(uname -sm)")"
((failed == 0)) && say "All good" || { say "Some failed"; exit 1; }
