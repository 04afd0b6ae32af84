#!/usr/bin/env bash
# usage: check_units.sh BUILD_DIR OUT.json [--packages DIR] [TRIAL...]
#
# The shipped units under a real systemd: a bare Debian 12 is booted in namespaces of its own (systemd-nspawn), as root, and
# in it units_trials.py starts, hangs and kills them; TRIAL names some of its trials. What is installed there are the Debian
# packages in DIR or, which is quicker while something changes, the programs and units of BUILD_DIR.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source_dir=$(cd "$here/../.." && pwd)
fail() { echo "units: $*" >&2; exit 1; }
[[ $(id -u) == 0 ]] || fail "a system is booted by root alone: run it under sudo"
command -v systemd-nspawn >/dev/null || fail "there is no systemd-nspawn: install the package systemd-container"
build=$(cd "$1" && pwd) out=$2
shift 2
packages=
if [[ ${1-} == --packages ]]; then
  packages=$(cd "$2" && pwd)
  shift 2
fi

# shellcheck source=tests/soak/bare_debian.sh
source "$here/bare_debian.sh"
machine=veneer-units-$$
booted='' group=''
cleanup() {
  if [[ -n $booted ]]; then
    kill "$booted" 2>/dev/null || true  # an orderly end: it powers itself off
    wait "$booted" 2>/dev/null || true
    rmdir "/run/systemd/nspawn/propagate/$machine" 2>/dev/null || true
    [[ -z $group ]] || find "$group" -depth -type d -exec rmdir {} + 2>/dev/null || true
  fi
  remove_root
}
trap cleanup EXIT

# The packages of this machine that hold the libraries of these programs.
packages_of() {
  ldd "$@" | awk '/=>/ { print $3 }' | sort -u | xargs realpath | sed 'p; s#^/usr##' | xargs dpkg-query --search 2>/dev/null |
    cut -d: -f1 | sort -u
}

make_root dbus iproute2 python3
if [[ -n $packages ]]; then
  install_packages "$packages" || fail "the packages do not install"
  # shellcheck disable=SC2046  # a word for each
  install_inside $(packages_of "$build/bin/veneer-proof") || fail "what veneer-proof needs does not install"
else
  programs=("$build"/bin/veneer{d,-guardian,-worker,-twin,ctl,ctl-plan,-proof})
  # shellcheck disable=SC2046
  install_inside $(packages_of "${programs[@]}") tesseract-ocr-eng || fail "what the programs need does not install"
  DESTDIR=$root cmake --install "$build" --prefix /usr >/dev/null
  inside systemd-sysusers
fi
umount "$root/proc"
mkdir -p "$root/trials/docs/images"
cp "$here"/{booted_cell,units_trials}.py "$build/bin/veneer-proof" "$source_dir/README.md" "$root/trials"
cp "$source_dir/docs/images/refined.jpg" "$root/trials/docs/images"

# Its processes are a group of their own. Where a systemd runs already, its filters of devices stand above those that are
# tried, and its groups cannot be entered from outside.
[[ ! -d /run/systemd/system ]] || fail "a systemd runs here, which has a hand in what is tried: use a container or machine without one"
mounted=$(awk '$3 == "cgroup2" { print $2; exit }' /proc/mounts)
[[ -n $mounted ]] || fail "cgroup v2 is not mounted here"
mkdir "$mounted/$machine" || fail "there are no groups of cgroup v2 here that root may make"
group=$mounted/$machine
# cgroup v2 alone, where the machine has both; no filter of system calls but the units' own, which
# could not be told from nspawn's.
(
  echo "$BASHPID" >"$group/cgroup.procs"
  SYSTEMD_NSPAWN_UNIFIED_HIERARCHY=1 SYSTEMD_SECCOMP=0 exec systemd-nspawn --register=no --keep-unit --quiet \
    --private-network --machine="$machine" --directory="$root" --boot --console=pipe
) </dev/null >"$work/boot.log" 2>&1 &
booted=$!
leader() { cut -d ' ' -f 1 "/proc/$booted/task/$booted/children"; }
within() { nsenter --target "$(leader)" --all /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@"; }
for ((tries = 0; ; ++tries)); do
  kill -0 "$booted" 2>/dev/null && ((tries < 6000)) || fail "no system boots here: $(tail -3 "$work/boot.log")"
  # "starting" has no end that could be waited for before its bus is there. Nobody but the booted system has the trials:
  # for a moment the first process stands where it was started.
  [[ $(within sh -c 'test -e /trials/units_trials.py && systemctl is-system-running' 2>/dev/null) =~ ^(running|degraded)$ ]] && break
  sleep 0.1
done
echo "$(within systemctl --version | head -1) is booted, on $(uname -sr)"

# Addresses that nobody but this system has: those that the drop-ins name as examples, and one of the network they name.
for address in 192.168.1.7 192.168.1.9 192.168.1.40; do within ip address add "$address/32" dev lo; done
result=0
within python3 /trials/units_trials.py /trials/out.json "$@" || result=1
mkdir -p "$(dirname "$out")"
cp "$root/trials/out.json" "$out"
exit $result
