#!/usr/bin/env bash
# usage: check_install.sh BUILD_DIR     installs into a prefix of its own and looks at what came out of it
set -euo pipefail
build=$1
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
fail() { echo "install: $*" >&2; exit 1; }

cmake --install "$build" --prefix "$prefix" >/dev/null
for file in lib/systemd/system/veneerd.service lib/systemd/system/veneer-guardian.service \
  lib/systemd/system/veneerd-backup.service lib/systemd/system/veneerd-backup.timer \
  lib/systemd/system/veneer-twin.service lib/systemd/system/veneer-demo.target lib/sysusers.d/veneerd.conf \
  lib/udev/rules.d/70-veneerd.rules etc/veneerd/veneerd.toml share/doc/veneerd/LICENSE \
  share/doc/veneerd/network-devices.conf share/doc/veneerd/notifications.conf share/doc/veneerd/other-machines.conf \
  share/doc/veneerd/usb-scanner.conf; do
  [[ -f $prefix/$file ]] || fail "$file is missing"
done
[[ ! -x $prefix/bin/veneerctl || -x $prefix/bin/veneerctl-plan ]] || fail "veneerctl came without its planner"
# Guides, and a man page for each command, as soon as this build makes them.
for guide in "$(dirname "$0")"/../../docs/*.md; do
  cmp -s "$guide" "$prefix/share/doc/veneerd/docs/$(basename "$guide")" || fail "the guide $(basename "$guide") is missing"
done
if [[ -x $prefix/bin/veneerctl && ! -e $build/cli/manual/stamp ]]; then
  echo "install: this build makes no man pages, so none was looked for"
elif [[ -x $prefix/bin/veneerctl ]]; then
  commands=$("$prefix/bin/veneerctl" --help | sed -n '/^Subcommands:/,$s/^  \([a-z-][a-z-]*\) .*/\1/p')
  [[ $commands == *job* ]] || fail "veneerctl --help names no commands"
  for command in $commands; do
    [[ -s $prefix/share/man/man1/veneerctl-$command.1 ]] || fail "there is no man page of veneerctl $command"
  done
  [[ -s $prefix/share/man/man1/veneerctl.1 ]] || fail "there is no man page of veneerctl"
  bash -n "$prefix/share/bash-completion/completions/veneerctl" || fail "the shell cannot read veneerctl's completion"
fi
if grep -n '@[a-z]*@' "$prefix"/lib/systemd/system/*; then fail "a unit holds a path that was not filled in"; fi

# Every path of the prefix that a unit names must be there.
paths=$(grep -ohE "$prefix/[^ ]+" "$prefix"/lib/systemd/system/*.service | sort -u)
for path in $paths; do
  # The programs are there as soon as this build makes them.
  [[ $path == */bin/* && ! -e $build/bin/$(basename "$path") ]] && continue
  [[ $path == */README.md && ! -e $(dirname "$0")/../../README.md ]] && continue
  [[ -e $path ]] || fail "a unit names $path, which is not installed"
done
for unit in veneerd veneer-twin; do
  grep -q "ExecStart=$prefix/bin/$unit --config $prefix/etc/veneerd/$unit.toml" \
    "$prefix/lib/systemd/system/$unit.service" || fail "$unit.service starts something else"
done

# The real cell's unit must never start a machine that stands in for one; the demo's starts both.
unit=$prefix/lib/systemd/system
if grep -E '^(Wants|Requires|BindsTo|PartOf|Upholds)=.*veneer-twin' "$unit/veneerd.service" "$unit/veneer-guardian.service"; then
  fail "veneerd.service starts the twin"
fi
if grep -q '^WantedBy=' "$unit/veneer-twin.service"; then fail "the twin starts with the machine"; fi
for started in veneerd veneer-twin; do
  grep -qE "^Wants=(.* )?$started.service( |$)" "$unit/veneer-demo.target" || fail "the demo does not start $started"
done
# The daemon and its guardian meet at one socket and speak of one record.
grep -q '^Wants=veneer-guardian.service$' "$unit/veneerd.service" || fail "nobody guards the daemon"
guardian=$(sed -n "s|^ExecStart=$prefix/bin/veneer-guardian ||p" "$unit/veneer-guardian.service")
[[ $guardian =~ ^--record\ ([^ ]+)\ --listen\ ([^ ]+)$ ]] || fail "the guardian is started in another way: $guardian"
grep -q -- " --guardian ${BASH_REMATCH[2]}\$" "$unit/veneerd.service" || fail "the guardian listens elsewhere"
grep -q "^ExecStopPost=-$prefix/bin/veneer-guardian --record ${BASH_REMATCH[1]} --settle\$" "$unit/veneerd.service" ||
  fail "what both leave behind is settled by nobody"

# The loop that owns the laser may go before what keeps the processors busy (daemon/threads/thread_priority.h).
nice=$(sed -n 's/^inline constexpr int kLoopNice = \(-[0-9]*\);$/\1/p' "$(dirname "$0")/../../daemon/threads/thread_priority.h")
grep -q "^LimitNICE=$nice\$" "$unit/veneerd.service" || fail "the laser's loop may not have its priority"
grep -q '^LimitNOFILE=4096$' "$unit/veneerd.service" || fail "full doors may leave no files for anything else"

# The nightly backup asks the daemon where it listens, as a user who may operate the cell, and is started by its timer.
listens=$(sed -n 's/^unix = "\(.*\)"$/\1/p' "$prefix/etc/veneerd/veneerd.toml")
grep -q "^ExecStart=$prefix/bin/veneerctl --socket $listens db backup$" "$unit/veneerd-backup.service" ||
  fail "the backup is asked for elsewhere"
[[ $(grep '^User=' "$unit/veneerd-backup.service") == "$(grep '^User=' "$unit/veneerd.service")" ]] ||
  fail "another user than the daemon's asks for the backup"
grep -q '^OnCalendar=' "$unit/veneerd-backup.timer" || fail "the backup has no time"
if grep -q '^WantedBy=' "$unit/veneerd-backup.service"; then fail "the backup starts with the machine, not by its timer"; fi

# What the units and the configuration say of each other's folders.
toml=$prefix/etc/veneerd/veneerd.toml
for name in $(sed -n 's/^\(State\|Runtime\)Directory=//p' "$unit"/veneerd.service "$unit"/veneer-twin.service |
  sort -u); do
  grep -qE "\"/(run|var/lib)/$name[/\"]" "$toml" || fail "the configuration uses nothing of $name"
done
socket=$(sed -n 's/^socket = "\(.*\)"$/\1/p' "$toml")
grep -q -- "--socket $socket\$" "$prefix/lib/systemd/system/veneer-twin.service" || fail "the twin listens elsewhere"

# A second installation keeps an operator's configuration.
echo '# mine' >>"$toml"
cmake --install "$build" --prefix "$prefix" >/dev/null
tail -1 "$toml" | grep -q '# mine' || fail "the configuration was overwritten"

# Packages stage below DESTDIR; with /usr the configuration is /etc's.
DESTDIR="$prefix/stage" cmake --install "$build" --prefix /usr >/dev/null
[[ -f $prefix/stage/etc/veneerd/veneerd.toml ]] || fail "with /usr the configuration belongs to /etc"
grep -q '^ExecStart=/usr/bin/veneerd --config /etc/veneerd/veneerd.toml ' \
  "$prefix/stage/usr/lib/systemd/system/veneerd.service" || fail "with /usr the unit starts something else"

if [[ -x $prefix/bin/veneerd ]]; then
  "$prefix/bin/veneerd" --config "$prefix/stage/etc/veneerd/veneerd.toml" --check-config >/dev/null ||
    fail "veneerd refuses its own configuration"
fi
