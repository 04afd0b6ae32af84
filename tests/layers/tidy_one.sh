#!/usr/bin/env bash
# usage: tidy_one.sh SOURCE     clang-tidy on one source of the dev build; prints only what it finds
set -euo pipefail
# g++'s own warning switches are no errors of clang, and clang's driver has no use for others.
if ! found=$(clang-tidy -p build/dev --quiet --extra-arg=-Wno-unknown-warning-option "$1" 2>/dev/null); then
  printf '%s\n' "$found"
  exit 1
fi
