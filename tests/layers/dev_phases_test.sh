#!/usr/bin/env bash
# ./dev tells how long each phase took, and at the end all that failed, and tells tests whether they get disks of their
# own. Compilers, tests and packages are stand-ins.
set -euo pipefail
unset AXE_CORE  # as somebody has it who has not asked for it
dev="$(readlink -f "${1:?where is dev}")"
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
mkdir -p "$place/cmake" "$place/bin" "$place/build/dev" "$place/build/asan"
cp "$dev" "$place/dev"
touch "$place/cmake/debian-packages.txt" "$place/build/dev/build.ninja" "$place/build/asan/build.ninja"
# The build that goes on beside the tests is good, fails, or is never done.
cat >"$place/bin/cmake" <<TEXT
#!/bin/sh
echo "\$*" >>"$place/calls"
case "\$*" in
  "--build --preset asan"*)
    echo \$\$ >"$place/compiling"
    case "\$BUILD" in good) exit 0 ;; bad) exit 3 ;; *) exec tail -f /dev/null ;; esac ;;
esac
TEXT
# Tests fail, once that build is under way; where it is never done, somebody interrupts.
cat >"$place/bin/ctest" <<TEXT
#!/bin/sh
until [ -s "$place/compiling" ]; do :; done
echo "mounts: \${VENEER_MOUNTS-unset}"
echo "axe: \${AXE_CORE-unset}"
[ "\$BUILD" != endless ] || kill -TERM \$PPID
exit 8
TEXT
# No registry, one that breaks off, one that has another file under that name, and one that has what is pinned.
mkdir "$place/package"
echo axe >"$place/package/axe.min.js"
tar -czf "$place/axe.tgz" -C "$place" package
cat >"$place/bin/npm" <<TEXT
#!/bin/sh
echo "npm \$*" >>"$place/npm_calls"
case "\${NPM-none}" in
none) exit 1 ;;
short) head -c 40 "$place/axe.tgz" >axe-core-4.14.1.tgz; exit 1 ;;
other) echo other >axe-core-4.14.1.tgz ;;
good) cp "$place/axe.tgz" axe-core-4.14.1.tgz ;;
esac
TEXT
sed -i "s/^axe_sha256=.*/axe_sha256=$(sha256sum <"$place/axe.tgz" | cut -d ' ' -f 1)/" "$place/dev"
chmod +x "$place/bin/cmake" "$place/bin/ctest" "$place/bin/npm"

# run BUILD STATUS, with $dev_path as its path, else with the stand-ins before all else
run() {
  local status=0
  rm -f "$place/compiling"
  told=$(BUILD=$1 TRIAL=1 PATH="${dev_path-$place/bin:$PATH}" "$place/dev" test 2>&1) || status=$?
  ((status == $2)) || { printf '%s: ended with %d instead of %d\n%s\n' "$1" "$status" "$2" "$told" >&2; exit 1; }
}
expect() {
  grep -qE "$1" <<<"$told" || { printf 'nothing like "%s" in:\n%s\n' "$1" "$told" >&2; exit 1; }
}

# mounts [VARIABLE=VALUE]: what tests are told of disks of their own, when a trial mount ends with $trial
mkdir -p "$place/tests/support"
printf '#!/bin/sh\nexit "$TRIAL"\n' >"$place/tests/support/may_mount.py"
chmod +x "$place/tests/support/may_mount.py"
mounts() {
  rm -f "$place/compiling"
  { env -u VENEER_MOUNTS BUILD=good TRIAL="$trial" PATH="$place/bin:$PATH" "$@" "$place/dev" test 2>&1 || true; } |
    sed -n 's/^mounts: //p' | sort -u
}
expect_mounts() {
  [[ $told == "$1" ]] || { echo "tests were told '$told' of mounts instead of '$1'" >&2; exit 1; }
}
# Accessibility that is not checked is told once, and checked by no file but the one that is pinned.
skips_axe() {
  run good 1
  expect '^Accessibility is not checked, and its tests are told as skipped: '
  [[ $(grep -c 'Accessibility is not checked' <<<"$told") == 1 ]] || { echo "told more than once: $told" >&2; exit 1; }
  expect '^axe: unset'
}
# Nor is npm needed: where neither it nor Debian's package can be had, tests go on.
mkdir "$place/without_npm"
for tool in /usr/bin/* "$place"/bin/*; do
  case ${tool##*/} in npm | npx | apt-get | sudo) ;; *) ln -sf "$tool" "$place/without_npm" ;; esac
done
printf '#!/bin/sh\nexit 100\n' | tee "$place/without_npm/apt-get" >"$place/without_npm/sudo"
chmod +x "$place"/without_npm/{apt-get,sudo}
echo "npm axe" >"$place/cmake/debian-packages.txt"
(export PATH="$place/without_npm" && dev_path=$PATH && skips_axe)
: >"$place/cmake/debian-packages.txt"
skips_axe
grep -q -- '--fetch-retries=0' "$place/npm_calls" || { echo "npm tries again and again where no registry answers" >&2; exit 1; }
NPM=short skips_axe
skips_axe
told=$(BUILD=good TRIAL=1 AXE_CORE=/there/axe.min.js PATH="$place/bin:$PATH" "$place/dev" test 2>&1 || true)
expect '^axe: /there/axe.min.js'
told=$(BUILD=good TRIAL=1 NPM=other PATH="$place/bin:$PATH" "$place/dev" test 2>&1 || true)
expect 'axe-core-4.14.1.tgz, which is not the axe-core@4.14.1 that ./dev pins'
[[ ! $told =~ axe: ]] || { echo "tests ran beside another axe-core" >&2; exit 1; }
NPM=good run good 1
expect "^axe: .*/package/axe.min.js"
[[ ! $told =~ Accessibility ]] || { echo "it is there, and told as missing: $told" >&2; exit 1; }
: >"$place/npm_calls"
run good 1
expect "^axe: .*/package/axe.min.js"
[[ ! -s $place/npm_calls ]] || { echo "what is there is fetched again" >&2; exit 1; }
rm -r "$place/build/axe"

trial=0
told=$(mounts) && expect_mounts 1
told=$(mounts VENEER_MOUNTS=) && expect_mounts ''
trial=1
told=$(mounts) && expect_mounts unset
told=$(mounts VENEER_MOUNTS=1) && expect_mounts 1

run good 1
expect '^ +[0-9]+ s  configuring and building as shipped$'
expect '^ +[0-9]+ s  tests as shipped \(FAILED\)$'
expect '^ +[0-9]+ s  building under sanitizers, what was left$'
expect '^ +[0-9]+ s  tests under sanitizers, and the demo beside them \(FAILED\)$'
expect '^ +[0-9]+ s  in all$'
expect '^dev: these failed, see above: $'
expect '^  tests as shipped$'
expect '^  tests under sanitizers$'
expect '^  the demo with seed [0-9]+: '

mkdir -p "$place/tests/soak"
printf '#   faults   of the driver\n' >"$place/tests/soak/run.sh"
# Who asks how a command is used has it told, and nothing is built.
rm -f "$place/calls"
for command in soak bench test; do
  told=$(PATH="$place/bin:$PATH" "$place/dev" "$command" --help)
  expect '^usage: '
done
[[ ! -e $place/calls ]] || { echo "--help builds" >&2; exit 1; }
! PATH="$place/bin:$PATH" "$place/dev" soak nonsense >/dev/null 2>&1 && [[ ! -e $place/calls ]] ||
  { echo "nonsense is no campaign, and nothing is built for it" >&2; exit 1; }
! PATH="$place/bin:$PATH" "$place/dev" nonsense --help >/dev/null 2>&1 || { echo "nonsense is no command" >&2; exit 1; }

# Unit tests under ThreadSanitizer: a share on each processor that this may use, whichever it is.
mkdir -p "$place/build/tsan"
touch "$place/build/tsan/build.ninja" "$place/compiling"
echo 1 >"$place/compiling"
printf '#!/bin/sh\n' | tee "$place/tests/soak/run.sh" >"$place/bin/taskset"
echo "echo \"\$2\" >>'$place/shares'" >>"$place/bin/taskset"
chmod +x "$place/tests/soak/run.sh" "$place/bin/taskset"
allowed=$(awk '/^Cpus_allowed_list:/ { print $2 }' /proc/self/status)
last=${allowed##*[,-]}
PATH="$place/bin:$PATH" "$(command -v taskset)" --cpu-list "$last" "$place/dev" soak threads >/dev/null 2>&1
[[ $(<"$place/shares") == "$last" ]] || { echo "shares on $(tr '\n' ' ' <"$place/shares")instead of $last" >&2; exit 1; }

run bad 1
expect '^dev: the build under sanitizers fails, and tests as shipped$'
expect '^ +[0-9]+ s  building under sanitizers, what was left \(FAILED\)$'

run endless 143
# What went on beside the tests has ended: it is gone, or dead and only not yet buried.
while grep -q '^State:.[RSD]' "/proc/$(<"$place/compiling")/status" 2>/dev/null; do :; done
