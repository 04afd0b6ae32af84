#!/usr/bin/env bash
# usage: soak_names_test.sh RUN_SH
#
# A batch of the daemon's kills can be picked by its number: it gets the cell that all of them begin with, and no other
# batch runs. The programs are stand-ins that say how they were called.
set -euo pipefail
run=$(realpath "$1")
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
mkdir -p "$place/tests" "$place/bin"
cat >"$place/tests/scenario_tests" <<'END'
#!/bin/sh
case $1 in
  */prepare_test.cc) mkdir -p "$VENEER_PREPARED_CELL" ;;
  *) [ -d "$VENEER_PREPARED_CELL" ] || { echo "no cell was prepared"; exit 1; } ;;
esac
END
chmod +x "$place/tests/scenario_tests"

# names PICKED: what ran.
names() {
  bash "$run" "$place" "$place/out.json" "$1" >"$place/told" 2>&1 || { cat "$place/told" >&2; return 1; }
  python3 -c 'import json, sys; print(*(c["name"] for c in json.load(open(sys.argv[1]))["campaigns"]))' "$place/out.json"
}
fail() { echo "$1" >&2; exit 1; }

for batch in 7 1 19; do
  ran=$(names "ledger/daemon-kills/$batch") || fail "batch $batch does not run"
  [[ $ran == "ledger/daemon-kills/prepare ledger/daemon-kills/$batch" ]] || fail "of batch $batch ran: $ran"
done
[[ $(names ledger/daemon-kills | wc -w) == 21 ]] || fail "all batches are twenty, and the cell they begin with"
! names ledger/daemon-kills/20 >/dev/null 2>&1 || fail "there is no batch 20"
