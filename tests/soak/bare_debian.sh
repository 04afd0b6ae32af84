# shellcheck shell=bash
# Sourced by the campaigns that try the programs in a bare Debian 12 of their own, in $root, which goes with them. A root is
# made by mmdebstrap and entered by chroot, so that this runs as root (or under sudo).
work=$(mktemp -d)
root=$work/root

remove_root() {
  local inside
  for inside in dev/pts proc sys; do mountpoint -q "$root/$inside" && umount --lazy "$root/$inside"; done
  rm -rf --one-file-system "$work"
}
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }

# make_root [PACKAGE...]: bare, but for these. Where this machine's packages come from, the bare one's do too.
make_root() {
  local IFS=,
  mmdebstrap --quiet --variant=minbase --include="ca-certificates,curl,systemd${1:+,$*}" bookworm "$root" >/dev/null
  mount --bind /proc "$root/proc"
}

# install_inside PACKAGE|FILE...
install_inside() {
  inside sh -c 'apt-get update -q && apt-get install -q -y --no-install-recommends "$@"' install "$@" >"$work/install.log" 2>&1 ||
    { tail -20 "$work/install.log" >&2; return 1; }
}

# install_packages FOLDER: those that ./dev package has built.
install_packages() {
  mkdir -p "$root/packages"
  cp "$1"/*.deb "$root/packages"
  # shellcheck disable=SC2046  # a word for each
  install_inside $(cd "$root" && printf '/%s\n' packages/*.deb)
}
