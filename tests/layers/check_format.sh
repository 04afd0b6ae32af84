#!/usr/bin/env bash
# usage: check_format.sh ROOT     every source is formatted as .clang-format says
set -euo pipefail
command -v clang-format >/dev/null || { echo "clang-format is not here"; exit 77; }
cd "$1"
git ls-files -z '*.h' '*.cc' 2>/dev/null | xargs -0 clang-format --dry-run -Werror
