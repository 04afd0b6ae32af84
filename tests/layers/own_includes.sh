#!/usr/bin/env bash
# usage: own_includes.sh     run at the root: "FILE INCLUDED" for every one of our headers a source of ours includes
set -euo pipefail
git ls-files '*.h' '*.cc' | xargs grep -HE '^[[:space:]]*#[[:space:]]*include "' |
  sed -E 's/^([^:]+):[[:space:]]*#[[:space:]]*include "([^"]+)".*/\1 \2/'
