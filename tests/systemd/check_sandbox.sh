#!/usr/bin/env bash
# usage: check_sandbox.sh BUILD_DIR     exposure of each installed unit <= 2.0, and what the daemon needs is still there
set -euo pipefail
command -v systemd-analyze >/dev/null || { echo "systemd-analyze is not here"; exit 77; }
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
fail() { echo "sandbox: $*" >&2; exit 1; }

DESTDIR=$stage cmake --install "$1" --prefix /usr >/dev/null
units=$stage/usr/lib/systemd/system
for unit in veneerd veneer-twin; do
  # The threshold is in tenths.
  systemd-analyze security --offline=true --threshold=20 --no-pager "$units/$unit.service" >"$stage/report" ||
    fail "$(tail -1 "$stage/report")"
  tail -1 "$stage/report"
done

has() { grep -qE "^$1\$" "$units/veneerd.service" || fail "veneerd.service lost: $1"; }
has 'Type=notify'
has 'WatchdogSec=[0-9]+'
for device in char-ttyUSB char-ttyACM char-pts char-usb_device char-video4linux; do has "DeviceAllow=$device rw"; done
# Without it libusb does not even begin.
has 'RestrictAddressFamilies=.*AF_NETLINK.*'
if grep -qE '^Private(Devices|Network|Users)=yes' "$units/veneerd.service"; then
  fail "veneerd must reach its devices and the loopback"
fi
