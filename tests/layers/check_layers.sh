#!/usr/bin/env bash
# usage: check_layers.sh ROOT     exits 1 with one line per broken rule
#
# Who may include whom (docs/ARCHITECTURE.md), read from the #include lines of the sources. Everything that may be
# included is listed: a room under the rooms that may, a library under its doors, a header of the system by name.
set -euo pipefail
cd "$1"

rooms=()
# Whatever holds a source, but for what a build or a run leaves.
while read -r room; do rooms+=("$room"); done < <(
  find . -mindepth 2 \( -name '*.h' -o -name '*.cc' \) -not -path './build/*' -not -path './out/*' -not -path './.*' |
    cut -d/ -f2 | LC_ALL=C sort -u
)
includes() { grep -rnE --include='*.h' --include='*.cc' '^[[:space:]]*#[[:space:]]*include[[:space:]]*[<"]' "$@" || true; }

includes "${rooms[@]}" | LC_ALL=C sort |
  awk '
    # Which room a path of ours belongs to; families of drivers are rooms of their own under the contracts, folders of
    # the daemon under its wiring.
    function room_of(path, part, depth) {
      depth = split(path, part, "/")
      if (part[1] == "daemon" && depth > 2) return "daemon/" part[2]
      if (part[1] != "drivers") return part[1]
      if (path ~ /^drivers\/[^\/]*$/) return "drivers"
      return (part[2] == "sim" && part[3] == "client") ? "drivers/sim/client" : "drivers/" part[2]
    }
    function complain(why) {
      print where ": includes " name ": " why
      broken = 1
    }
    # Headers that match `headers` may be included by the files that match `files`.
    function door(headers, files) {
      ++doors
      door_headers[doors] = headers
      door_files[doors] = files
    }
    BEGIN {
      # Rooms that a room may include, apart from itself; and of the room in `only_of`, only these files.
      allowed["base"] = ""
      allowed["calib"] = allowed["planner"] = allowed["db"] = allowed["drivers"] = "base"
      allowed["drivers/transport"] = allowed["drivers/file"] = allowed["drivers/sane"] = allowed["drivers/v4l2"] = "base drivers"
      allowed["drivers/sim/client"] = "base drivers"
      allowed["drivers/grbl"] = allowed["drivers/lihuiyu"] = "base drivers"
      allowed["drivers/sim"] = "base"
      # So that errors cannot cancel, the twin shares no geometry with what it checks (docs/ARCHITECTURE.md).
      only_of["drivers/sim"] = "base/clock.h base/ids.h base/log.h base/result.h base/units.h"
      allowed["guardian"] = "base drivers drivers/transport drivers/lihuiyu drivers/sim/client"
      allowed["daemon/threads"] = "base"
      allowed["daemon/workers"] = "base"
      allowed["daemon/api"] = "base console daemon/threads"
      allowed["daemon/store"] = "base calib db daemon/threads"
      allowed["daemon/unit"] = "base calib db drivers daemon/store daemon/threads"
      allowed["daemon/orders"] = "base calib db drivers drivers/sane drivers/v4l2 planner daemon daemon/store daemon/workers"
      allowed["daemon/records"] = "base db daemon/api daemon/store daemon/threads"
      allowed["daemon/stock"] = "base calib db drivers planner daemon daemon/orders daemon/store daemon/threads daemon/workers"
      allowed["daemon/devices"] = "base drivers daemon daemon/orders daemon/stock daemon/store daemon/threads daemon/unit" \
                                  " daemon/workers"
      allowed["daemon/news"] = "base calib db drivers daemon daemon/api daemon/devices daemon/orders" \
                               " daemon/records daemon/stock daemon/store daemon/threads daemon/unit daemon/workers"
      allowed["daemon/plans"] = "base db drivers drivers/lihuiyu planner daemon daemon/api daemon/orders daemon/stock daemon/store" \
                                " daemon/threads daemon/unit daemon/workers"
      allowed["daemon/calibration"] = "base calib drivers planner daemon daemon/devices daemon/orders daemon/stock daemon/store" \
                                      " daemon/unit daemon/workers"
      allowed["daemon/routes"] = "base calib db drivers drivers/lihuiyu planner daemon daemon/api daemon/orders daemon/store" \
                                 " daemon/threads daemon/unit daemon/workers daemon/records daemon/stock daemon/devices" \
                                 " daemon/news daemon/plans daemon/calibration"
      # Of the wiring, what everybody needs who is wired.
      only_of["daemon/orders"] = "daemon/config.h"
      only_of["daemon/stock"] = only_of["daemon/devices"] = only_of["daemon/news"] = "daemon/config.h"
      only_of["daemon/plans"] = only_of["daemon/calibration"] = "daemon/config.h"
      allowed["daemon"] = "base drivers drivers/file drivers/grbl drivers/lihuiyu drivers/sim/client" \
                          " drivers/transport calib planner db guardian console daemon/api daemon/routes" \
                          " daemon/store daemon/threads daemon/unit daemon/workers daemon/records daemon/stock daemon/devices" \
                          " daemon/news daemon/plans daemon/calibration"
      allowed["cli"] = "base planner"
      allowed["tests"] = "base drivers drivers/file drivers/grbl drivers/lihuiyu drivers/sane drivers/sim drivers/sim/client" \
                         " drivers/transport drivers/v4l2 calib planner db guardian daemon daemon/api daemon/orders daemon/routes" \
                         " daemon/store daemon/threads daemon/unit daemon/workers daemon/records daemon/stock daemon/devices" \
                         " daemon/news daemon/plans daemon/calibration cli console"

      # The language, C, POSIX and Linux are open to all; a library has its doors.
      open_to_all = "^([a-z_]+|(dlfcn|emmintrin|fcntl|fnmatch|grp|immintrin|malloc|netdb|poll|pthread|pwd|sched|signal|spawn|stdlib|termios|time|unistd)\\.h|(arpa|linux|net|netinet|sys)/[a-z_/]+\\.h)$"
      door("^(Eigen|unsupported/Eigen)/", "^(base/frames\\.h|calib/|tests/)")
      door("^(gtest|gmock|rapidcheck|benchmark)[/.]", "^tests/")
      door("^CLI/", "^(daemon/main\\.cc|cli/|drivers/sim/|tests/)")
      door("^(SQLiteCpp/|sqlite3)", "^(db|tests/(db|scenarios))/")
      door("^apriltag/", "^(calib/tag_(detector|pattern)\\.cc|drivers/sim/|tests/support/|tests/drivers/sim_)")
      door("^archive", "^(base/archive\\.cc$|tests/base/)")
      door("^boost/beast", "^(daemon/(api/|orders/webhook\\.cc$)|cli/|tests/)")
      door("^boost/", "^(drivers/|guardian/|daemon/|cli/|tests/)")
      door("^cairo", "^(daemon/(calibration/fiducial_print|stock/panel_label)\\.cc|planner/(assembly|cutting|pages)/)")
      door("^dl_[a-z]+\\.h", "^tests/")
      door("^fmt/", "^(base|drivers|calib|planner|db|guardian|daemon|cli|tests)/")
      door("^jpeglib", "^(planner/pictures/jpeg_codec\\.cc|tests/planner/)")
      door("^linux/videodev2", "^(drivers/v4l2/(control_lock|proposed_settings|video_device)\\.cc$|tests/support/(camera_file|played_webcam)\\.h$)")
      door("^lcms2", "^(planner/pictures/picture_colours\\.cc|tests/planner/)")
      door("^libusb", "^drivers/transport/usb_port\\.cc$")
      door("^mosquitto\\.h$", "^(daemon/orders/mqtt\\.cc|tests/daemon/news/notifier_test\\.cc)$")
      door("^nlohmann/", "^(daemon/|cli/|planner/|drivers/sim/|tests/)")
      door("^opencv2/", "^(base/raster\\.h|calib/|planner/|daemon/(orders|routes|stock)/|cli/|drivers/sim/|tests/)")
      door("^openssl/", "^(base/(base64|hash)|daemon/api/(random_token|tls))\\.cc$")
      door("^png\\.h", "^(cli/painted_mask\\.cc|planner/pictures/png_codec\\.cc|tests/planner/)")
      door("^polyclipping/", "^base/polygon_ops\\.cc$")
      door("^pugixml", "^(planner/drawings/svg_drawing\\.cc|planner/cutting/|tests/)")
      door("^prometheus/", "^daemon/news/metrics\\.cc$")
      door("^qrencode\\.h$", "^daemon/stock/panel_label\\.cc$")
      door("^sanitizer/", "^tests/support/")
      door("^sane/", "^drivers/sane/sane_library\\.cc$")
      door("^seccomp", "^(daemon/workers/confinement|tests/systemd/under_filter)\\.cc$")
      door("^sodium", "^daemon/api/passwords\\.cc$")
      door("^spdlog/", "^(base/(log|journal)\\.(h|cc)|daemon/|cli/|drivers/|tests/)")
      door("^systemd/", "^daemon/(main|api/watchdog)\\.cc$")
      door("^tesseract/", "^drivers/sim/proof/")
      door("^tiffio", "^(planner/pictures/(tiff_inks|tile_pyramid)\\.cc|tests/planner/)")
      door("^toml", "^(daemon|drivers/sim)/")
      door("^umockdev", "^tests/support/(board|camera)_file")
      door("^zbar\\.h$", "^tests/daemon/stock/panel_label_test\\.cc$")
      door("^zlib", "^(planner/pictures/(picture_metadata|png_codec|tiff_inks)\\.cc|tests/planner/|daemon/api/gzip\\.cc)")
    }
    function holds(list, word) { return index(" " list " ", " " word " ") > 0 }
    function check_room() {
      if (name !~ /\//) return complain("includes start at the root")
      if (target == room) return
      if (target == "tests" && room != "tests") return complain("nothing but a test includes tests")
      if (!(room in allowed)) return complain("room " room " is not in the layer rule")
      if (!holds(allowed[room], target)) return complain(room " may include: " allowed[room])
      # A list of files of one room: the twin has base, folders of the daemon its wiring.
      if (room in only_of && index(only_of[room], target "/") == 1 && !holds(only_of[room], name))
        complain(room " may include of " target ": " only_of[room])
    }
    function check_library(i) {
      if (name ~ open_to_all) return
      for (i = 1; i <= doors; ++i) {
        if (name !~ door_headers[i]) continue
        if (file !~ door_files[i]) complain("its door is " door_files[i])
        return
      }
      complain("no library is listed for it, nor is it a header of the system that is")
    }
    {
      colon = index($0, ":")
      file = substr($0, 1, colon - 1)
      rest = substr($0, colon + 1)
      where = file ":" substr(rest, 1, index(rest, ":") - 1)
      match(rest, /[<"][^>"]*/)
      name = substr(rest, RSTART + 1, RLENGTH - 1)
      room = room_of(file)
      target = room_of(name)
      if (substr(rest, RSTART, 1) == "<")
        check_library()
      else
        check_room()
      if (name ~ /^toml/ && toml_door[room] != "" && toml_door[room] != file)
        complain("one file of " room " reads TOML, " toml_door[room])
      if (name ~ /^toml/) toml_door[room] = file
    }
    END { exit broken + 0 }'
