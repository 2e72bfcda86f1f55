#!/usr/bin/env bash
# Installs the package where there is no index and no compiler: from a folder that has its wheel and those of its
# dependencies, into a new environment of each Python named. Then makes the demo and the smoke test in an empty folder,
# without a network where the system can take it away (unshare). The folder is filled first, for Python 3.11 to 3.14,
# unless it is there.
#
#   packaging/check_offline.sh dist wheelhouse python3.11 python3.13
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
dist=${1:?the folder of the wheels is missing} wheelhouse=${2:?the folder to fill or to install from is missing}
shift 2
pythons=("$@")
((${#pythons[@]})) || { echo "Name at least one Python" >&2; exit 2; }

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
unset PYTHONPATH

if [ ! -d "$wheelhouse" ]; then
    pip=("${pythons[0]}" -m pip --disable-pip-version-check download --quiet --only-binary :all:)
    "${pip[@]}" --no-index --no-deps --find-links "$dist" --dest "$place/own" kerrcaustics
    for version in 3.11 3.12 3.13 3.14; do
        "${pip[@]}" --python-version "$version" --dest "$place/filled" "$place"/own/*.whl
    done
    mv "$place/filled" "$wheelhouse"
fi
wheelhouse=$(cd "$wheelhouse" && pwd)
printf '== %s: %s wheels, %s\n' "$wheelhouse" "$(find "$wheelhouse" -name '*.whl' | wc -l)" "$(du -sh "$wheelhouse" | cut -f 1)"

alone=()
! unshare --net true 2>/dev/null || alone=(unshare --net)
for python in "${pythons[@]}"; do
    env=$place/env
    "$python" -m venv --clear "$env"
    "$env/bin/python" -m pip --disable-pip-version-check install --quiet --no-index --find-links "$wheelhouse" kerrcaustics
    mkdir "$env/empty"
    (
        cd "$env/empty"
        # No compiler is on this path.
        run=(env -i HOME="$env/empty" PATH="$env/bin" MPLBACKEND=Agg "$env/bin/python")
        ${alone[@]+"${alone[@]}"} "${run[@]}" -m kerrcaustics demo >/dev/null
        ${alone[@]+"${alone[@]}"} "${run[@]}" "$here/smoke.py" plain >log
        printf '== good%s: %s, %s\n' "${alone:+, no network}" "$("$env/bin/python" --version)" "$(tail -n 1 log)"
    )
done
