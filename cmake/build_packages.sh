#!/usr/bin/env bash
# usage: build_packages.sh OUT JOBS     Debian packages of this tree, built in a copy of it as dpkg-buildpackage does
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
mkdir -p "$1"
out=$(cd "$1" && pwd) jobs=$2

# The copy stands where the last one stood, so that a compiler cache knows it again.
rooms=(CMakeLists.txt CMakePresets.json CHANGELOG.md LICENSE README.md base calib cli cmake console daemon db docs drivers
       guardian planner systemd)
copy=$root/build/package/veneerd
rm -rf "$copy"
mkdir -p "$copy"
(cd "$root" && cp -R "${rooms[@]}" "$copy")
mv "$copy/cmake/debian" "$copy/debian"

version=$(sed -n 's/^project(veneerd VERSION \([0-9.]*\).*/\1/p' "$root/CMakeLists.txt")
# The same tree makes the same packages, to the byte.
SOURCE_DATE_EPOCH=$(git -C "$root" log -1 --format=%ct 2>/dev/null || date +%s)
export SOURCE_DATE_EPOCH
cat >"$copy/debian/changelog" <<TEXT
veneerd ($version) bookworm; urgency=medium

  * See /usr/share/doc/veneerd/changelog.gz.

 -- The veneerd authors <veneerd@example.org>  $(date -R -u -d "@$SOURCE_DATE_EPOCH")
TEXT

cd "$copy"
DEB_BUILD_OPTIONS="parallel=$jobs noautodbgsym nocheck" dpkg-buildpackage -b -us -uc >&2
rm -f "$out"/*.deb "$out"/*.changes "$out"/*.buildinfo
mv ../*.deb ../*.changes ../*.buildinfo "$out"
ls "$out" >&2
