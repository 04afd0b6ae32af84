#!/usr/bin/env bash
# usage: check_package.sh PACKAGES      the Debian packages in a bare Debian 12: installed, looked at, run, purged
set -euo pipefail
packages=$(cd "$1" && pwd)
# shellcheck source=tests/soak/bare_debian.sh
source "$(dirname "${BASH_SOURCE[0]}")/bare_debian.sh"
daemon='' twin=''
cleanup() {
  for process in $daemon $twin; do kill "$process" 2>/dev/null || true; done
  wait 2>/dev/null || true
  # What they started stands in the root as well: the guardian, workers.
  remove_root
}
trap cleanup EXIT
fail() { echo "package: $*" >&2; exit 1; }

make_root
mkdir -p "$root/dev/pts"
mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
ln -sf pts/ptmx "$root/dev/ptmx"

echo "installing"
install_packages "$packages" || fail "the packages do not install"
inside id veneer >/dev/null || fail "there is no user veneer"
for unit in veneerd veneer-guardian veneer-twin; do
  [[ ! -e $root/etc/systemd/system/multi-user.target.wants/$unit.service ]] || fail "$unit starts by itself"
done
inside systemd-analyze verify /lib/systemd/system/{veneerd.service,veneer-guardian.service,veneerd-backup.service,veneerd-backup.timer,veneer-twin.service,veneer-demo.target} ||
  fail "systemd finds fault with a unit"
inside veneerctl --version >/dev/null
inside veneerctl plan --help >/dev/null
# Debian compresses what is long.
there() { [[ -s $root/usr/share/$1 || -s $root/usr/share/$1.gz ]]; }
for page in man1/veneerctl.1 man1/veneerctl-job.1 man1/veneerctl-panel.1 man8/veneerd.8 man8/veneer-guardian.8 man8/veneer-twin.8; do
  there "man/$page" || fail "the man page $page is missing"
done
for guide in "$(dirname "${BASH_SOURCE[0]}")"/../../docs/*.md; do
  there "doc/veneerd/docs/$(basename "$guide")" || fail "the guide $(basename "$guide") is missing"
done
there doc/veneerd/README.md || fail "README.md is missing"
inside bash -n /usr/share/bash-completion/completions/veneerctl || fail "the shell cannot read veneerctl's completion"

# What the units would do, by hand: as their user, in their folders, by their own lines.
# No guardian's unit runs here: the daemon starts a guardian of its own.
starts() { sed -n 's/ --guardian [^ ]*//; s/^ExecStart=//p' "$root/lib/systemd/system/$1.service"; }
for folder in run/veneerd run/veneer-guardian run/veneer-twin var/lib/veneerd var/lib/veneer-twin; do
  inside install -d -o veneer -g veneer -m 0750 "/$folder"
done
# In the background only: the process that is waited for is the program itself.
as_veneer() { exec chroot --userspec=veneer:veneer "$root" /usr/bin/env -i PATH=/usr/bin:/bin LC_ALL=C.UTF-8 "$@"; }
read -ra line <<<"$(starts veneer-twin)"
as_veneer "${line[@]}" >"$work/twin.log" 2>&1 &
twin=$!
read -ra line <<<"$(starts veneerd)"
as_veneer "${line[@]}" >"$work/daemon.log" 2>&1 &
daemon=$!
for ((tries = 0; ; ++tries)); do
  inside veneerctl --socket /run/veneerd/veneerd.sock status >"$work/status" 2>&1 && break
  kill -0 "$daemon" 2>/dev/null && ((tries < 600)) || { tail -20 "$work/daemon.log" >&2; fail "the daemon does not answer"; }
  sleep 0.1
done
page=$(inside curl --fail --silent --show-error http://127.0.0.1:8765/console) && [[ $page == *"<html"* ]] ||
  fail "the console does not answer"
echo "the daemon and its console answer"
kill "$daemon"
wait "$daemon" || fail "the daemon does not end in order"
daemon=''
kill "$twin"
wait "$twin" || true
twin=''
[[ -s $root/var/lib/veneerd/veneerd.db || -n $(find "$root/var/lib/veneerd" -name '*.db') ]] || fail "there is no ledger"

echo "purging"
inside apt-get purge -q -y veneerd veneerctl veneer-twin veneer-doc >"$work/purge.log" 2>&1 || { tail "$work/purge.log" >&2; fail "the packages do not go"; }
[[ -n $(find "$root/var/lib/veneerd" -name '*.db') ]] || fail "a purge that was not asked to took the ledger"
[[ ! -e $root/var/lib/veneer-twin && ! -e $root/etc/veneerd/veneerd.toml ]] || fail "a purge left what is nobody's"

install_packages "$packages" || fail "a second installation fails"
echo 'veneerd veneerd/remove-stock boolean true' | inside debconf-set-selections
inside apt-get purge -q -y veneerd >"$work/purge.log" 2>&1 || fail "a second purge fails"
[[ ! -e $root/var/lib/veneerd ]] || fail "a purge that was asked to left the ledger"
echo "purged: the ledger stays unless it is asked for"
