#!/usr/bin/env bash
# usage: check_rules.sh SYSTEMD_DIR     the udev rules jump to labels that exist, and say what they must
set -euo pipefail
rules=$1/70-veneerd.rules
fail() { echo "udev: $*" >&2; exit 1; }

for label in $(grep -oE 'GOTO="[a-z_]+"' "$rules" | cut -d'"' -f2 | sort -u); do
  grep -q "^LABEL=\"$label\"$" "$rules" || fail "no label $label"
done
# Keys and operators only: KEY{attr}OP"value", separated by commas, with continued lines joined.
sed -e ':a' -e '/\\$/{N;s/\\\n//;ba' -e '}' "$rules" | grep -vE '^[[:space:]]*(#|$)' |
  while IFS= read -r line; do
    [[ $line =~ ^([A-Z]+(\{[A-Za-z_]+\})?(==|!=|=|\+=)\"[^\"]*\"(,[[:space:]]*|[[:space:]]*$))+$ ]] ||
      fail "this line is no rule: $line"
  done
for needed in 'ATTR{idVendor}=="1a86", ATTR{idProduct}=="5512"' 'ATTRS{idVendor}=="1a86", ATTRS{idProduct}=="7523' \
  'ATTRS{idVendor}=="0403"' 'ATTRS{idVendor}=="10c4"' 'ATTRS{idVendor}=="2341' 'ID_MM_DEVICE_IGNORE' 'SYMLINK+="veneer/laser-' \
  'TAG+="systemd"'; do
  grep -qF "$needed" "$rules" || fail "the rules lost $needed"
done
grep -qE '^u veneer ' "$1/veneerd.sysusers" || fail "there is no user veneer"
