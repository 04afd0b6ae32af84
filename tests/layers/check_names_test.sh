#!/usr/bin/env bash
# usage: check_names_test.sh     the test of names finds each kind of clash, and says nothing of what can stand side by side
set -euo pipefail
check="$(cd "$(dirname "$0")" && pwd)/check_names.sh"
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
failures=0

# hidden TEXT: a source that declares it in an anonymous namespace of ours.
hidden() { printf 'namespace veneer::%s {\nnamespace {\n\n%s\n\n}  // namespace\n}  // namespace veneer::%s\n' "$1" "$2" "$1"; }

# judge WHAT EXPECTED: EXPECTED is part of the complaint, "" for none.
judge() {
  local said status=0
  said=$("$check" "$tree") || status=$?
  if [[ -z $2 && $status -eq 0 && -z $said ]]; then return; fi
  if [[ -n $2 && $status -eq 1 && $said == *"$2"* ]]; then return; fi
  echo "$1: expected '${2:-nothing}', got status $status: $said"
  failures=1
}

# try FIRST SECOND EXPECTED: what two sources of one library declare.
try() {
  rm -rf "${tree:?}"/*
  mkdir "$tree/calib"
  printf 'veneer_add_library(veneer_calib\n  SOURCES a.cc  # the first\n    b.cc DEPS veneer_base)\n' >"$tree/calib/CMakeLists.txt"
  hidden calib "$1" >"$tree/calib/a.cc"
  hidden calib "$2" >"$tree/calib/b.cc"
  judge "$1 beside $2" "$3"
}

both='calib/b.cc:4: %s is a name of calib/a.cc:4 too: both are in veneer_calib'
# shellcheck disable=SC2059  # the format is the one above
clash() { try "$1" "$2" "$(printf "$both" "$3")"; }

clash 'constexpr double kMixed = 0.15;' 'constexpr int kMixed{3};' kMixed
clash 'constexpr double kBending = 0.0025, kMixed = 100;' 'constexpr double kMixed = 0.15;' kMixed
clash 'constexpr std::array<int, 2> kBoth{1, 2}, kMixed{3, 4};' 'const int kMixed = 3;' kMixed
clash 'struct Side {
  int a;
};' 'class Side final : public Edge {
};' Side
clash 'enum class Side { kLeft };' 'using Side = int;' Side
clash 'int turn(int a) { return a; }' 'struct turn {};' turn
clash 'double median(std::vector<double> values) { return 0; }' 'double median(std::vector<double>& all) {
  return 1;
}' median
clash 'double median(const Points* values);' 'template <class T>
T median(const std::vector<T>& values) {
  return values[0];
}' median
clash '[[nodiscard]] bool far(const Point<PanelFrame>& a, double by = 2);' 'int far(Point<PanelFrame> b, double);' far
clash 'std::map<std::string,
         int>
numbers(int from);' 'void numbers(int) {}' numbers

try 'constexpr double kMixed = 0.15;' 'constexpr double kMixedRim = 0.15;  // not kMixed = 1' ''
try 'json to_json(const Panel& panel) { return {}; }' 'json to_json(const Job& job) { return {}; }' ''
try 'int f() {
  constexpr int kStep = 2;
  return kStep;
}' 'int g() {
  constexpr int kStep = 3;
  return kStep;
}' ''
try 'struct Side;
struct Side {
  int a;
};' 'const char* kText = "struct Side {";' ''
try 'int f(int a);' 'int Other::f(int a) { return 1; }' ''
try 'constexpr const char* kSql = R"(
struct Side {
)";' 'struct Side {
};' ''

# Nor do two libraries share what is hidden, and two namespaces of one library.
rm -rf "${tree:?}"/* && mkdir "$tree/calib" "$tree/db"
printf 'veneer_add_library(veneer_calib SOURCES a.cc)\nveneer_add_library(veneer_other SOURCES b.cc)\n' >"$tree/calib/CMakeLists.txt"
hidden calib 'struct Side {};' | tee "$tree/calib/b.cc" >"$tree/calib/a.cc"
judge "two libraries" ''
printf 'veneer_add_library(veneer_calib SOURCES a.cc)\ntarget_sources(veneer_calib PRIVATE\n  b.cc)\n' >"$tree/calib/CMakeLists.txt"
judge "sources that are named later" 'calib/b.cc:4: Side is a name of calib/a.cc:4 too'
hidden calib::rims 'struct Side {};' >"$tree/calib/b.cc"
judge "two namespaces" ''

# header TEXT: what a source with `struct Side` in it says to a header's declaration, in the folder `at`.
header() {
  rm -rf "${tree:?}"/*
  mkdir -p "$tree/calib" "$tree/$1"
  printf 'veneer_add_library(veneer_calib SOURCES a.cc)\n' >"$tree/calib/CMakeLists.txt"
  hidden calib 'struct Side {};
int turn(int a);' >"$tree/calib/a.cc"
  printf 'namespace veneer::calib {\n\n%s\n\n}  // namespace veneer::calib\n' "$2" >"$tree/$1/side.h"
  judge "a header of $1 with $2" "$3"
}
header calib 'enum class Side { kLeft };' 'calib/a.cc:4: Side is a name of calib/side.h:3 too: a header declares it'
header calib 'double turn(int degrees);' 'turn is a name of calib/side.h:3 too'
header calib 'double turn(double degrees);' ''
header calib 'struct Edge {
  struct Side {};
};' ''
header tests 'struct Side {};' ''  # which no library may include

exit $failures
