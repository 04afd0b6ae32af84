#!/usr/bin/env bash
# usage: check_layers_test.sh     the layer test finds each kind of broken rule, and says nothing of a tree that keeps them
set -euo pipefail
check="$(cd "$(dirname "$0")" && pwd)/check_layers.sh"
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
failures=0

# try PATH LINE EXPECTED: the tree holds one file with one include; EXPECTED is part of the complaint, "" for none.
try() {
  rm -rf "${tree:?}"/*
  mkdir -p "$tree/base" "$tree/$(dirname "$1")"
  printf '%s\n' "$2" >"$tree/$1"
  local said status=0
  said=$("$check" "$tree") || status=$?
  if [[ -z $3 && $status -eq 0 && -z $said ]]; then return; fi
  if [[ -n $3 && $status -eq 1 && $said == *"$3"* ]]; then return; fi
  echo "$1 with $2: expected '${3:-nothing}', got status $status: $said"
  failures=1
}

try base/a.cc '#include "base/units.h"' ''
try base/a.cc '#include "db/ledger.h"' 'base may include'
try calib/a.cc '#include "planner/plan.h"' 'calib may include: base'
try calib/a.h '#  include "drivers/laser_driver.h"' 'calib may include: base'
try planner/a.cc '#include "base/frames.h"' ''
try db/a.cc '#include "calib/bed_pose.h"' 'db may include: base'
try drivers/grbl/a.cc '#include "drivers/laser_driver.h"' ''
try drivers/grbl/a.cc '#include "drivers/sim/world.h"' 'drivers/grbl may include'
try drivers/sim/a.cc '#include "base/frames.h"' 'drivers/sim may include of base'
try drivers/sim/a.cc '#include "base/stroke.h"' 'drivers/sim may include of base'
try drivers/sim/a.cc '#include "base/units.h"' ''
try drivers/sane/a.cc '#include <sane/sane.h>' 'its door is'
try daemon/orders/a.cc '#include "drivers/sane/scan_order.h"' ''
try daemon/a.cc '#include "drivers/sane/scan_order.h"' 'daemon may include'
try drivers/sim/client/a.cc '#include "drivers/camera_driver.h"' ''
try daemon/a.cc '#include "db/ledger.h"' ''
try cli/a.cc '#include "daemon/config.h"' 'cli may include'
try daemon/a.cc '#include "tests/support/x.h"' 'nothing but a test'
try daemon/a.cc '#include "config.h"' 'start at the root'
try daemon/a.cc '#include <SQLiteCpp/Database.h>' 'its door is'
try db/a.cc '#include <SQLiteCpp/Database.h>' ''
try calib/a.cc '#include <apriltag/apriltag.h>' 'its door is'
try planner/a.cc '#include <polyclipping/clipper.hpp>' 'its door is'
try db/a.cc '#include <nlohmann/json.hpp>' 'its door is'
try base/a.cc '#include <gtest/gtest.h>' 'its door is'
try daemon/unit/a.cc '#include <openssl/rand.h>' 'its door is'
try daemon/api/tls.cc '#include <openssl/ssl.h>' ''
try daemon/news/a.cc '#include <systemd/sd-daemon.h>' 'its door is'
try daemon/api/watchdog.cc '#include <systemd/sd-daemon.h>' ''
try daemon/a.cc '#include "drivers/sim/world.h"' 'daemon may include'
try daemon/unit/a.cc '#include "daemon/store/calibration.h"' ''
try daemon/unit/a.cc '#include "daemon/plans/plan_service.h"' 'daemon/unit may include'
try daemon/unit/a.cc '#include "planner/plan.h"' 'daemon/unit may include'
try daemon/api/a.cc '#include "db/ledger.h"' 'daemon/api may include'
try daemon/plans/a.cc '#include "daemon/routes/page.h"' 'daemon/plans may include'
try daemon/plans/a.cc '#include "daemon/config.h"' ''
try daemon/plans/a.cc '#include "daemon/cell.h"' 'daemon/plans may include of daemon'
try tests/a.cc '#include "somewhere/a.h"' 'tests may include'
try shelf/a.cc '#include "base/units.h"' 'room shelf is not in the layer rule'
try base/a.cc '#include "shelf/a.h"' 'base may include'
try base/a.cc '#include <vector>' ''
try drivers/transport/a.cc '#include <sys/ioctl.h>' ''
try base/a.cc '#include <curl/curl.h>' 'no library is listed'
try base/a.cc '#include <ncurses.h>' 'no library is listed'

mkdir -p "$tree/daemon"
rm -f "$tree"/daemon/*
printf '#include <toml++/toml.h>\n' | tee "$tree/daemon/config.cc" >"$tree/daemon/other.cc"
"$check" "$tree" >/dev/null && { echo "two files of a room read TOML unseen"; failures=1; }
exit $failures
