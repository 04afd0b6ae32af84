// What the twin's socket can be asked. One JSON object in, one out: {"ok":true,...} or {"ok":false,"code","error"} with
// a sentence. Knows nothing of sockets.
//
// Threading: requests for which is_quick() holds are handled on the reactor, at once; all others on one worker, in
// order.
#pragma once

#include <atomic>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/log.h"
#include "base/result.h"
#include "drivers/sim/camera.h"
#include "drivers/sim/laser_bench.h"
#include "drivers/sim/world.h"

namespace veneer::sim {

class TwinService {
 public:
  TwinService(World& world, LaserBench& laser, Logger log);

  static bool is_quick(const nlohmann::json& request);
  nlohmann::json handle(const nlohmann::json& request);
  // What a line that is not a JSON object is answered with.
  static nlohmann::json refusal(const Error& error);

 private:
  using Reply = Result<nlohmann::json>;
  using Handler = Reply (TwinService::*)(const nlohmann::json&);
  struct Command;
  static const Command* find(const nlohmann::json& request);

  Reply status(const nlohmann::json& request);
  Reply new_panel(const nlohmann::json& request);
  Reply new_grid(const nlohmann::json& request);
  Reply new_board(const nlohmann::json& request);
  Reply place(const nlohmann::json& request);
  Status make_if_usual(const std::string& sheet);
  Reply lift(const nlohmann::json& request);
  Reply nudge(const nlohmann::json& request);
  Reply measure(const nlohmann::json& request);
  Reply scan(const nlohmann::json& request);
  Reply camera(const nlohmann::json& request);
  Reply glance(const BedView& view);
  Reply lid(const nlohmann::json& request);
  Reply fault(const nlohmann::json& request);
  Reply power(const nlohmann::json& request);
  Reply consent(const nlohmann::json& request);
  Reply signal_at_burn(const nlohmann::json& request);
  Reply fill_disk_at_burn(const nlohmann::json& request);
  Reply send_at_burn(const nlohmann::json& request);
  Reply burn_log(const nlohmann::json& request);
  void forget_old(const std::string& kind, int newest, int kept) const;

  World& world_;
  LaserBench& laser_;
  std::optional<BedCamera> eye_, glancing_eye_;  // of the worker
  Logger log_;
  std::atomic<bool> scanner_dead_{false}, camera_dead_{false}, camera_dark_{false};
  double drifted_ = 0;
};

}  // namespace veneer::sim
