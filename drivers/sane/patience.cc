#include "drivers/sane/patience.h"

#include <future>
#include <memory>
#include <thread>
#include <utility>

namespace veneer::sane {

bool returns_within(std::chrono::milliseconds time, std::function<void()> call) {
  auto done = std::make_shared<std::promise<void>>();
  auto returned = done->get_future();
  std::thread([done, call = std::move(call)] {
    call();
    done->set_value();
  }).detach();
  return returned.wait_for(time) == std::future_status::ready;
}

}  // namespace veneer::sane
