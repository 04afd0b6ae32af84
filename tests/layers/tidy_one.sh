#!/usr/bin/env bash
# usage: tidy_one.sh SOURCE     clang-tidy on one source of the dev build; prints only what it finds
#
# A source that was clean is not read again until it, one of our headers it includes, or .clang-tidy changes: ninja knows
# what each object was made of (build/dev/tidy/dependencies), and the hash of all that names a file in build/dev/tidy/.
set -euo pipefail
source=$1
ours=$(awk -v source="$source" -v root="$PWD/" '
  /^[^ ]/ { taken = 0; first = 1; next }
  NF == 0 { next }
  {
    path = $1
    sub(/^(\.\.\/)+/, root, path)
    if (first) { taken = (path == source); first = 0 }
    if (taken && index(path, root) == 1) print path
  }' build/dev/tidy/dependencies)
# shellcheck disable=SC2086  # one argument per path; ours have no spaces
key=$(cat .clang-tidy tests/.clang-tidy "$source" $ours | sha256sum | cut -c1-40)
[[ -e build/dev/tidy/$key ]] && exit 0

# g++'s own warning switches are no errors of clang.
if ! found=$(clang-tidy -p build/dev --quiet --extra-arg=-Wno-unknown-warning-option "$source" 2>/dev/null); then
  printf '%s\n' "$found"
  exit 1
fi
touch "build/dev/tidy/$key"
