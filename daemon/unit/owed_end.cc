#include "daemon/unit/owed_end.h"

#include <fmt/format.h>

#include <utility>

#include "base/clock.h"

namespace veneer::daemon {

bool OwedEnd::take(const laser_event::Aborted& told) {
  if (!breaking_) return false;
  breaking_->take(told);
  return true;
}

void OwedEnd::write(std::function<void(int neighbours)> then) {
  write_end(*std::exchange(breaking_, std::nullopt),
            [then = std::move(then)](const Result<int>& written) { then(written ? *written : 0); });
}

void OwedEnd::write_end(BrokenRun run, Written then) {
  unwritten_ = run;
  host_.parts().database.async(
      [run = std::move(run)](Repositories& r) { return write_down(r, run, utc_timestamp()); },
      host_.while_current([this, then = std::move(then)](const Result<int>& written) {
        if (!written) log_->error("the end of the run could not be written: {}", written.error().message);
        if (is_written(written)) {
          unwritten_.reset();
          return then(written);
        }
        then(Error{written.error().code,
                   fmt::format("the end of the run is not written yet: {}", written.error().message)});
      }));
}

}  // namespace veneer::daemon
