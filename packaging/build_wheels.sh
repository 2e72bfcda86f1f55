#!/usr/bin/env bash
# Builds the wheels of all platforms into a folder, on one machine: the kernels are cross-compiled. In each wheel it looks
# for kernels of its platform and of browsers, and none of another. Some minutes; needs uv and the network, no compiler,
# nothing of .venv.
#
#   packaging/build_wheels.sh dist                    # all
#   packaging/build_wheels.sh dist aarch64-macos      # some
set -euo pipefail
folder=$(mkdir -p "${1:?the folder of the wheels is missing}" && cd "$1" && pwd)
cd "$(dirname "${BASH_SOURCE[0]}")/.."
shift
# As kerrcaustics/beams/kernels/build.py names them.
platforms=("$@")
((${#platforms[@]})) || platforms=(
    x86_64-linux-gnu aarch64-linux-gnu x86_64-linux-musl aarch64-linux-musl x86_64-macos aarch64-macos
)

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
for platform in "${platforms[@]}"; do
    built=$place/$platform
    printf '== Building the wheel of %s\n' "$platform"
    KERRCAUSTICS_PLATFORM=$platform uv build --quiet --wheel --out-dir "$built" .
    kernels=$(python3 -m zipfile --list "$built"/*.whl | sed -n 's:^kerrcaustics/beams/kernels/objects/\(kernels-[^ ]*\).*:\1:p')
    case $platform in x86_64-*) level=x86-64-v[234] ;; *) level=aarch64 ;; esac
    case $platform in *-macos) ending=dylib ;; *) ending=so ;; esac
    of_browsers=$(grep '\.wasm$' <<<"$kernels" | sort | xargs)
    own=$(grep -v '\.wasm$' <<<"$kernels" || true)
    if [ "$of_browsers" != "kernels-plain.wasm kernels-simd.wasm" ] || [ -z "$own" ] ||
        grep -v "^kernels-$level\.$ending\$" <<<"$own"; then
        printf 'Kernels of another platform, or none, are in the wheel of %s\n' "$platform" >&2
        exit 1
    fi
    mv "$built"/*.whl "$folder"
done
