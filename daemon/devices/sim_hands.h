// What a person's hands do at a cell that is simulated in all its devices: lay a sheet down, take it away, open the
// lid. Of any other cell there are none to be played.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

struct SimSheet {
  std::string name, kind;  // "panel", "board", "grid"
  std::string where;       // "shelf", "scanner", "bed"
};

struct SheetToLay {
  std::string sheet;               // "grid", "board" and "panel" are made when they are not there yet
  std::string on;                  // "scanner" or "bed"
  std::string face;                // scanner: the face at the glass; bed: the face that looks up. "show" or "back"
  std::string part;                // of it on the glass; "" = the whole
  double height_mm = 0;            // on blocks
  std::optional<double> turn_deg;  // on the bed, about its middle; not given: somewhere, as a hand lays it
};

// Each call waits for the twin's process. Any thread, but not the reactor.
struct SimHands {
  std::function<Result<std::vector<SimSheet>>()> sheets;
  std::function<Status(const SheetToLay&)> lay;
  std::function<Status(const std::string& from)> lift;
  std::function<Status(bool open)> lid;
  std::function<Status(const std::string& name)> new_panel;  // of veneer strips, with its tags
};

}  // namespace veneer::daemon
