#!/usr/bin/env bash
# usage: tidy_one.sh SOURCE     clang-tidy on one source, or one batch of sources, of build/tidy; prints only what it finds
#
# A source that was clean is not read again until it, one of our headers it includes, directly or not, its compiler's
# arguments or .clang-tidy change: the hash of all that names a file in build/tidy/clean/.
set -euo pipefail
source=$1
ours=$(
  {
    cat build/tidy/own_includes
    # A batch includes its sources by their full path.
    sed -nE "s|^ *# *include \"$PWD/([^\"]+)\".*|$source \1|p" "$source"
  } | awk -v source="$source" -v root="$PWD/" '
    { includes[$1] = includes[$1] " " $2 }
    function visit(file, names, count, i) {
      if (seen[file]++) return
      print file
      count = split(includes[file], names, " ")
      for (i = 1; i <= count; i++) visit(names[i])
    }
    END {
      if (index(source, root) == 1 && (substr(source, length(root) + 1) in includes)) visit(substr(source, length(root) + 1))
      visit(source)
    }' | while read -r file; do if [[ -f $file ]]; then printf '%s\n' "$file"; fi; done
)
# shellcheck disable=SC2086  # one argument per path; ours have no spaces
key=$({ cat .clang-tidy tests/.clang-tidy cmake/VeneerTargets.cmake cmake/VeneerDependencies.cmake $ours; } | sha256sum | cut -c1-40)
[[ -e build/tidy/clean/$key ]] && exit 0

# A batch lies beside none of its sources: say whose rules it is read by.
rules=()
# Clang's -Wconversion warns of every int that counts into a vector, g++'s, which tests are built by, of those that may lose
# something.
case $source in */tests/*) rules=(--config-file=tests/.clang-tidy --extra-arg=-Wno-sign-conversion) ;; esac

# g++'s own switches are no errors of clang.
if ! found=$(clang-tidy -p build/tidy --quiet "${rules[@]}" --extra-arg=-Wno-unknown-warning-option \
  --extra-arg=-Wno-unused-command-line-argument "$source" 2>/dev/null); then
  printf '%s\n' "$found"
  exit 1
fi
touch "build/tidy/clean/$key"
