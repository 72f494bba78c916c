#!/usr/bin/env bash
# Installs what a clean Debian or Ubuntu machine lacks, and nothing that is there already.
#
#   scripts/setup.sh compiler                what scripts/demo needs
#   scripts/setup.sh compiler python node tools pictures package cargo-tools     what scripts/test needs (also: scripts/setup.sh all)
#
# Rust is presupposed; everything else is named here, each package where it is needed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Versions that were tried with our toolchain; a newer one may want a newer Rust.
NEXTEST_VERSION=0.9.151
DENY_VERSION=0.20.2
DEB_VERSION=3.8.0
CRYPTOGRAPHY_VERSION=46
SGP4_VERSION=2.27
SKYFIELD_VERSION=1.55
ERFA_VERSION=2.0
SCHEMATHESIS_VERSION=4.32
SPACE_PACKET_PARSER_VERSION=6.2
KAITAI_VERSION=0.11.0
YAML_VERSION=2.9.1

say() { printf 'setup: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }
have() { command -v "$1" >/dev/null 2>&1; }

apt_index_is_fresh=no

# install PACKAGE... with apt-get, through sudo when we are not root.
install_packages() {
  local as_root=()
  have apt-get || fail "this machine has no apt-get; please install these Debian packages or their like by hand: $*"
  if [ "$(id -u)" -ne 0 ]; then
    have sudo || fail "cannot install $*: you are not root and there is no sudo; please run: apt-get install $*"
    as_root=(sudo)
  fi
  say "installing $*"
  if [ "$apt_index_is_fresh" = no ]; then
    ${as_root[@]+"${as_root[@]}"} apt-get update -qq >&2 || say "apt-get update failed; trying with the package list that is here"
    apt_index_is_fresh=yes
  fi
  ${as_root[@]+"${as_root[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >&2 \
    || fail "apt-get could not install $*; please install it by hand and try again"
}

rust() {
  have cargo || [ ! -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ] || PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
  have cargo || fail "there is no cargo: install Rust $(rust_version) or newer (rustup.rs, or your distribution) and try again"
}

rust_version() { sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml; }

# The bundled SQLite and ring are C: a compiler, a linker and the C library's headers.
compiler() {
  rust
  local c_program='#include <stdlib.h>
int main(void) { return 0; }'
  printf '%s\n' "$c_program" | cc -x c - -o /dev/null 2>/dev/null || install_packages build-essential # gcc, libc6-dev
}

# scripts/vectors.py and scripts/orbit_vectors.py make the test vectors with other people's libraries, and
# scripts/fuzz-api asks a server what schemathesis thinks of, and scripts/decoder-kit decodes with the runtime of Kaitai
# Struct and with a reader of XTCE that brings the schema; all in .venv.
python() {
  local packages=("cryptography>=$CRYPTOGRAPHY_VERSION" "sgp4>=$SGP4_VERSION" "skyfield>=$SKYFIELD_VERSION" "pyerfa>=$ERFA_VERSION" "schemathesis>=$SCHEMATHESIS_VERSION,<5"
    "kaitaistruct>=${KAITAI_VERSION%.*}" "space-packet-parser>=$SPACE_PACKET_PARSER_VERSION,<7")
  python3 -c 'import venv, ensurepip' 2>/dev/null || install_packages python3 python3-venv
  if ! .venv/bin/python -c 'import cryptography, sgp4, skyfield, erfa, schemathesis, kaitaistruct, space_packet_parser' 2>/dev/null; then
    say "making .venv with ${packages[*]}"
    python3 -m venv --clear .venv || fail "python3 could not make .venv"
    .venv/bin/python -m pip install --quiet --disable-pip-version-check "${packages[@]}" \
      || fail "pip could not install ${packages[*]} into .venv"
  fi
}

# scripts/decoder-kit compiles docs/decoder/pixelsat.ksy. The compiler (GPL) and what it needs are tools: they stay in
# .node, and nothing of them is linked or shipped.
javascript() {
  local packages=("kaitai-struct-compiler@$KAITAI_VERSION" "kaitai-struct@$KAITAI_VERSION" "yaml@$YAML_VERSION") package held
  { have node && have npm; } || install_packages nodejs npm
  for package in "${packages[@]}"; do
    held=.node/node_modules/${package%@*}/package.json
    grep -qs "\"version\": \"${package#*@}\"" "$held" && continue
    say "filling .node with ${packages[*]}"
    mkdir -p .node
    npm install --silent --no-save --no-package-lock --no-audit --no-fund --ignore-scripts --prefix .node "${packages[@]}" >&2 \
      || fail "npm could not install ${packages[*]} into .node"
    break
  done
}

# End-to-end tests watch system calls, speak HTTP from outside, start PostgreSQL servers of their own, drive hamlib's dummy rotator and rig,
# and publish to brokers of their own.
tools() {
  have strace || install_packages strace
  have curl || install_packages curl ca-certificates
  { have psql && { have initdb || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1; }; } || install_packages postgresql
  { have rotctld && have rigctld; } || install_packages libhamlib-utils
  { { have mosquitto || [ -x /usr/sbin/mosquitto ]; } && have mosquitto_pub; } || install_packages mosquitto mosquitto-clients
}

# Pictures of the desk's widgets are drawn without a display: by software Vulkan, or else by software OpenGL.
pictures() {
  have dpkg || return 0
  local package missing=()
  for package in mesa-vulkan-drivers libgl1-mesa-dri libegl1; do
    dpkg -s "$package" >/dev/null 2>&1 || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"
}

# install_cargo_tool CRATE VERSION [OPTION...]: builds it when it is not in the path. Its artefacts stay out of our target folder.
install_cargo_tool() {
  local crate=$1 version=$2
  shift 2
  have "$crate" && return
  say "building $crate $version once (some minutes)"
  env -u CARGO_TARGET_DIR -u RUSTFLAGS cargo install --quiet --locked "$@" "$crate@$version" >&2 || fail "cargo could not install $crate $version"
}

# scripts/package and scripts/package-check make the Debian package, and ask systemd what it thinks of the unit: the package
# systemd is needed for its systemd-analyze alone, nothing is started.
package() {
  rust
  PATH="$PATH:${CARGO_INSTALL_ROOT:-${CARGO_HOME:-$HOME/.cargo}}/bin"
  have dpkg-deb || install_packages dpkg
  have systemd-analyze || install_packages systemd
  install_cargo_tool cargo-deb "$DEB_VERSION" --no-default-features
}

cargo_tools() {
  rust
  cargo fmt --version >/dev/null 2>&1 || fail "cargo fmt is missing: rustup component add rustfmt"
  cargo clippy --version >/dev/null 2>&1 || fail "cargo clippy is missing: rustup component add clippy"
  PATH="$PATH:${CARGO_INSTALL_ROOT:-${CARGO_HOME:-$HOME/.cargo}}/bin"
  install_cargo_tool cargo-nextest "$NEXTEST_VERSION"
  install_cargo_tool cargo-deny "$DENY_VERSION"
}

[ $# -gt 0 ] || set -- all
for need in "$@"; do
  case "$need" in
    compiler) compiler ;;
    python) python ;;
    node) javascript ;;
    tools) tools ;;
    pictures) pictures ;;
    package) package ;;
    cargo-tools) cargo_tools ;;
    all) compiler; python; javascript; tools; pictures; package; cargo_tools ;;
    *) fail "unknown need '$need': compiler, python, node, tools, pictures, package, cargo-tools or all" ;;
  esac
done
