#!/usr/bin/env bash
# usage: check_layers.sh ROOT     exits 1 with one line per broken rule
#
# Who may include whom (DESIGN.md, section 4) and the one door of each library (STYLE.md, section 3), read from the
# #include lines of the sources.
set -euo pipefail
cd "$1"

rooms=()
for room in base drivers calib planner db daemon cli tests; do
  if [[ -d $room ]]; then rooms+=("$room"); fi
done
includes() { grep -rnE --include='*.h' --include='*.cc' '^[[:space:]]*#[[:space:]]*include[[:space:]]*[<"]' "$@" || true; }

includes "${rooms[@]}" | LC_ALL=C sort |
  awk '
    # Which room a path of ours belongs to; families of drivers are rooms of their own under the contracts.
    function room_of(path, part) {
      split(path, part, "/")
      if (part[1] != "drivers") return part[1]
      if (path ~ /^drivers\/[^\/]*$/) return "drivers"
      return (part[2] == "sim" && part[3] == "client") ? "drivers/sim/client" : "drivers/" part[2]
    }
    function complain(why) {
      print where ": includes " name ": " why
      broken = 1
    }
    # A library may be included only by files that match `door`.
    function one_door(library, door) {
      if (angled && name ~ library && file !~ door) complain("its door is " door)
    }
    # Rooms that a room may include, apart from itself.
    BEGIN {
      allowed["base"] = ""
      allowed["calib"] = allowed["planner"] = allowed["db"] = allowed["drivers"] = "base"
      allowed["drivers/transport"] = allowed["drivers/file"] = allowed["drivers/sim/client"] = "base drivers"
      allowed["drivers/grbl"] = allowed["drivers/lihuiyu"] = allowed["drivers/sane"] = allowed["drivers/v4l"] = "base drivers"
      allowed["drivers/sim"] = "base"
      allowed["daemon"] = "*"
      allowed["cli"] = "base planner"
      allowed["tests"] = "*"
    }
    {
      colon = index($0, ":")
      file = substr($0, 1, colon - 1)
      rest = substr($0, colon + 1)
      where = file ":" substr(rest, 1, index(rest, ":") - 1)
      match(rest, /[<"][^>"]*/)
      name = substr(rest, RSTART + 1, RLENGTH - 1)
      angled = substr(rest, RSTART, 1) == "<"
      room = room_of(file)
      target = room_of(name)

      if (!angled && name !~ /\//) complain("includes start at the root")
      if (!angled && name ~ /^tests\// && room != "tests") complain("nothing but a test includes tests")
      if (!angled && name !~ /^tests\// && target != room && allowed[room] != "*") {
        if (!(room in allowed)) complain("room " room " is not in the layer rule")
        else if (index(" " allowed[room] " ", " " target " ") == 0) complain(room " may include: " allowed[room])
      }
      # So that errors cannot cancel, the twin shares no geometry with what it checks (DESIGN.md, section 6).
      if (room == "drivers/sim" && name ~ /^base\/(geometry|frames|raster|polygon_ops|point_fit)\.h$/)
        complain("the twin shares no geometry with what it checks")

      one_door("^(SQLiteCpp/|sqlite3)", "^(db|tests/(db|scenarios))/")
      one_door("^nlohmann/", "^(daemon/|cli/|planner/|drivers/sim/|tests/)")
      one_door("^apriltag/", "^(calib/tag_detector\\.cc|drivers/sim/|tests/support/|tests/drivers/sim_)")
      one_door("^polyclipping/", "^base/polygon_ops\\.cc$")
      one_door("^openssl/", "^(base/hash\\.cc|daemon/)")
      one_door("^opencv2/", "^(base/raster\\.h|calib/|planner/|daemon/|cli/|drivers/|tests/)")
      one_door("^boost/", "^(drivers/|daemon/|cli/|tests/)")
      one_door("^boost/beast", "^(daemon/api/|cli/|tests/)")
      one_door("^(Eigen|unsupported/Eigen)/", "^(base/frames\\.h|calib/|tests/)")
      one_door("^CLI/", "^(daemon/main\\.cc|cli/|drivers/sim/|tests/)")
      one_door("^systemd/", "^daemon/")
      one_door("^spdlog/", "^(base/log\\.(h|cc)|daemon/|cli/|drivers/|tests/)")
      one_door("^libusb", "^drivers/transport/usb_port\\.cc$")
      one_door("^umockdev", "^tests/support/board_file")
      one_door("^tesseract/", "^drivers/sim/proof/")
      one_door("^(gtest|gmock|rapidcheck|benchmark)[/.]", "^tests/")
      one_door("^lcms2", "^(planner/pictures/picture_colours\\.cc|tests/planner/)")
      one_door("^jpeglib", "^(planner/pictures/jpeg_codec\\.cc|tests/planner/)")
      one_door("^png\\.h", "^(planner/pictures/png_codec\\.cc|tests/planner/)")
      one_door("^tiffio", "^(planner/pictures/tiff_inks\\.cc|tests/planner/)")
      one_door("^zlib", "^(planner/pictures/(picture_metadata|png_codec)\\.cc|tests/planner/)")
      one_door("^toml", "^(daemon|drivers/sim)/")
      if (angled && name ~ /^toml/ && toml_door[room] != "" && toml_door[room] != file)
        complain("one file of " room " reads TOML, " toml_door[room])
      if (angled && name ~ /^toml/) toml_door[room] = file
    }
    END { exit broken + 0 }'
