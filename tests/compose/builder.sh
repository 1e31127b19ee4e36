#!/usr/bin/env bash
# Makes an image to build in out of this machine's own Rust toolchain, C linker and crates: a stand-in for the official
# Rust image where no registry of images is in reach. Nothing is downloaded, neither here nor by a build in it.
#
# Compiling hundreds of crates anew in every build would take minutes, so the image brings what they were compiled to: the
# Dockerfile's own command is given here first, in target/compose, which stays for the next time. The cargo of the build
# in the image then finds its work done, as far as it agrees that it is.
#
#   builder.sh IMAGE LABEL PROFILE       exit code 77: this machine lacks something, said in one line
set -euo pipefail
image=$1 label=$2 profile=$3
cd "$(dirname "$0")/../.."

lacking() {
    echo "$1"
    exit 77
}
command -v dpkg-query >/dev/null || lacking "not a Debian, whose packages the build image is put together from"
rustc=$(rustc --print sysroot)
crates=${CARGO_HOME:-$HOME/.cargo}
[ -d "$crates/registry/cache" ] || lacking "no crates in $crates/registry/cache"
target=$(rustc -vV | sed -n 's/^host: //p')

# A package and all that it needs, of those that are installed; Debian names alternatives, versions and architectures.
closure() {
    local -A seen=()
    local wanted=("$@") name
    while [ ${#wanted[@]} -gt 0 ]; do
        name=${wanted[-1]}
        unset 'wanted[-1]'
        [ -z "${seen[$name]:-}" ] || continue
        seen[$name]=1
        mapfile -t -O "${#wanted[@]}" wanted < <(
            { dpkg-query -W -f '${Pre-Depends},${Depends}\n' "$name" 2>/dev/null || true; } |
                tr ',|' '\n\n' | sed 's/^ *//; s/[ (:].*//; /^$/d'
        )
    done
    printf '%s\n' "${!seen[@]}"
}

RUSTFLAGS="-C target-feature=+crt-static" cargo build --locked --profile "$profile" --target "$target" \
    --target-dir target/compose --package network-emulator --package vehicle-node --package mission-control --bins

files() {
    # base-files brings the folders, dash /bin/sh. On a merged /usr a file is where its folder really is.
    closure base-files dash coreutils sed gcc libc6-dev | while read -r package; do
        dpkg-query -L "$package" 2>/dev/null || true
    done | grep -v '^/usr/share' | while read -r path; do
        if [ -L "$path" ]; then
            echo "$(readlink -f "$(dirname "$path")")/$(basename "$path")"
        elif [ -f "$path" ]; then
            readlink -f "$path"
        fi
    done
    for link in /bin /sbin /lib /lib64 /usr/bin/sh /usr/bin/cc /etc/alternatives/cc; do
        [ ! -L "$link" ] || echo "$link"
    done
    echo /tmp
    printf '%s\n' "$rustc/bin/cargo" "$rustc/bin/rustc"
    find "$rustc/lib" -path '*/rustlib/*' -prune -o \( -type f -o -type l \) -print
    find "$rustc/lib/rustlib/$target" "$crates/registry/index" "$crates/registry/cache" \( -type f -o -type l \) -print
    find "$PWD/target/compose" -name incremental -prune -o -type f -print
    for settings in "$crates/config.toml" "$crates/config"; do
        [ ! -f "$settings" ] || echo "$settings"
    done
}

files | sed 's|^/*||' | sort -u |
    tar -c -C / --format=posix --no-recursion --transform "s|^${PWD#/}/target/compose/|src/target/|" -T - | docker import \
    --change "ENV PATH=$rustc/bin:/usr/bin:/bin" --change "ENV CARGO_HOME=$crates" \
    --change "ENV CARGO_NET_OFFLINE=true" --change "LABEL $label=1" - "$image"
