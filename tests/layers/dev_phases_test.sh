#!/usr/bin/env bash
# ./dev tells how long each phase took, that which failed among them. Compilers, tests and packages are stand-ins.
set -euo pipefail
dev="$(readlink -f "${1:?where is dev}")"
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
mkdir -p "$place/cmake" "$place/bin" "$place/build/dev"
cp "$dev" "$place/dev"
touch "$place/cmake/debian-packages.txt" "$place/build/dev/build.ninja"
# The build that goes on beside the tests is never done.
cat >"$place/bin/cmake" <<TEXT
#!/bin/sh
case "\$*" in
  "--build --preset asan"*) echo \$\$ >"$place/compiling"; exec tail -f /dev/null ;;
esac
TEXT
cat >"$place/bin/ctest" <<TEXT
#!/bin/sh
until [ -s "$place/compiling" ]; do :; done
exit 8
TEXT
chmod +x "$place/bin/cmake" "$place/bin/ctest"

status=0
told=$(PATH="$place/bin:$PATH" "$place/dev" test 2>&1) || status=$?
expect() {
  grep -qE "$1" <<<"$told" || { printf 'nothing like "%s" in:\n%s\n' "$1" "$told" >&2; exit 1; }
}
((status == 8)) || { printf 'ended with %d instead of 8\n%s\n' "$status" "$told" >&2; exit 1; }
expect '^ +[0-9]+ s  configuring and building as shipped$'
expect '^ +[0-9]+ s  tests as shipped \(FAILED\)$'
expect '^ +[0-9]+ s  in all$'
# What went on beside them has ended: it is gone, or dead and only not yet buried.
while grep -q '^State:.[RSD]' "/proc/$(<"$place/compiling")/status" 2>/dev/null; do :; done
