#!/usr/bin/env bash
# usage: check_sandbox.sh BUILD_DIR     exposure of each installed unit <= 1.5, and what the daemon needs is still there
set -euo pipefail
command -v systemd-analyze >/dev/null || { echo "systemd-analyze is not here"; exit 77; }
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
fail() { echo "sandbox: $*" >&2; exit 1; }

DESTDIR=$stage cmake --install "$1" --prefix /usr >/dev/null
units=$stage/usr/lib/systemd/system
for unit in veneerd veneerd-backup veneer-guardian veneer-twin; do
  # The threshold is in tenths.
  systemd-analyze security --offline=true --threshold=15 --no-pager "$units/$unit.service" >"$stage/report" ||
    fail "$(tail -1 "$stage/report")"
  tail -1 "$stage/report"
done

has() { grep -qE "^$1\$" "$units/veneerd.service" || fail "veneerd.service lost: $1"; }
has 'Type=notify'
has 'WatchdogSec=[0-9]+'
# A worker that takes too much memory goes; the daemon stays.
has 'OOMPolicy=continue'
has 'MemoryMax=[0-9]+%'
# A core would keep the laser's port from the guardian.
has 'LimitCORE=1'
# ttyUSB, ttyACM, ttyS, ttyAMA, pts, usb_device and video4linux: their names would count only with their drivers loaded before.
for device in 188 166 4 204 136 189 81; do has "DeviceAllow=char-$device rw"; done
# Without it libusb does not even begin.
has 'RestrictAddressFamilies=.*AF_NETLINK.*'
for device in 188 166 4 204 136 189; do
  grep -qx "DeviceAllow=char-$device rw" "$units/veneer-guardian.service" || fail "the guardian lost the device $device"
done
# Whatever ends the daemon's group or is short of memory must not end the guardian with it.
if grep -qE '^(PartOf|BindsTo|Requires|StopWhenUnneeded|Slice)=' "$units/veneer-guardian.service"; then
  fail "the guardian must not end with the daemon"
fi
grep -qx 'StartLimitIntervalSec=0' "$units/veneer-guardian.service" || fail "systemd may give the guardian up"
grep -qE '^OOMScoreAdjust=-' "$units/veneer-guardian.service" || fail "the guardian is killed for memory as others are"
if grep -qE '^Private(Devices|Network|Users)=yes' "$units/veneerd.service"; then
  fail "veneerd must reach its devices and the loopback"
fi

# The calls that the unit allows, as systemd reads its lines from the first to the last.
calls_of() {  # NAME...: sets resolved
  local name
  for name in "$@"; do
    if [[ $name == @* ]]; then
      # shellcheck disable=SC2046  # one word each
      calls_of $(systemd-analyze syscall-filter --no-pager "$name" | sed -n 's/^ \+\([a-z0-9_@-]\+\)$/\1/p')
    else
      echo "$name"
    fi
  done
}
: >"$stage/calls"
while read -r line; do
  # shellcheck disable=SC2086  # a list of words
  if [[ $line == "~"* ]]; then
    calls_of ${line#\~} | sort -u >"$stage/denied"
    grep -vxFf "$stage/denied" "$stage/calls" >"$stage/left" || true
    mv "$stage/left" "$stage/calls"
  else
    calls_of $line >>"$stage/calls"
  fi
done < <(sed -n 's/^SystemCallFilter=//p' "$units/veneerd.service")
sort -u -o "$stage/calls" "$stage/calls"
# Under it a worker can be started, confines itself and is limited.
"$1/bin/veneer-under-filter" "$stage/calls" "$1/tests/daemon_workers_tests" \
  --gtest_filter='*DoWhatIsAsked*:*ReachNoSocket*:*TakeNoMoreMemory*:*CannotOpenTheLasersPort*:*ThatScan*:*ThatLookThroughACamera*' >"$stage/workers" ||
  { cat "$stage/workers"; fail "workers cannot do their work under the unit's filter"; }
tail -1 "$stage/workers"
