#include "drivers/grbl/send_window.h"

#include <cstdlib>

namespace veneer::grbl {

SendWindow::SendWindow(std::size_t capacity_bytes) : capacity_(capacity_bytes) {}

void SendWindow::sent(std::string_view line) {
  if (!fits(line)) std::abort();
  in_flight_ += line.size();
  lengths_.push_back(line.size());
}

Status SendWindow::acknowledged() {
  if (lengths_.empty())
    return Error{ErrorCode::kDeviceFault, "the laser controller answered a line that was never sent"};
  in_flight_ -= lengths_.front();
  lengths_.pop_front();
  return Ok();
}

void SendWindow::clear() {
  lengths_.clear();
  in_flight_ = 0;
}

}  // namespace veneer::grbl
