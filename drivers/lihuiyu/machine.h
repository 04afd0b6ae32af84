// The link to a board, and what is known of the machine behind it. What any of it means for what the driver is about is
// the phases' business (phase.h).
//
// Pure; not thread-safe.
#pragma once

#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/lihuiyu/lihuiyu_options.h"
#include "drivers/lihuiyu/mil_path.h"
#include "drivers/lihuiyu/packet_link.h"
#include "drivers/usb_transport.h"

namespace veneer::lihuiyu {

struct LihuiyuOutput {
  std::string urgent;  // a packet to write before all else; what waits or is under way is given up
  std::vector<UsbRequest> requests;
  bool close = false;  // the link is of no more use
};

struct Machine {
  explicit Machine(const LihuiyuOptions& machine_options)
      : options(machine_options), grid{options.travel_x_mm, options.travel_y_mm}, link(options) {}

  const LihuiyuOptions options;
  const MilGrid grid;
  PacketLink link;
  LihuiyuOutput output;  // but for the link's own requests
  TimePoint now;
  BoardState state = BoardState::kReady;  // as its lines said last
  bool homed = false;
  MilPoint at;  // where the head rests
};

}  // namespace veneer::lihuiyu
