#include "daemon/records/kept_file.h"

#include <fstream>
#include <mutex>
#include <span>
#include <string>
#include <utility>

#include "base/files.h"

namespace veneer::daemon {

struct KeptFile::State {
  State(std::filesystem::path its_file, Logger its_log) : file(std::move(its_file)), log(std::move(its_log)) {}

  const std::filesystem::path file;
  const Logger log;
  bool failed = false;  // the worker's: told once, until it is written again
  std::mutex mutex;
  std::function<nlohmann::json()> newest;  // guarded by mutex; empty: nothing is to be written

  void save() {
    std::function<nlohmann::json()> content;
    {
      const std::lock_guard lock(mutex);
      content = std::exchange(newest, nullptr);
    }
    if (!content) return;
    const std::string text = content().dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    const Status written = write_whole(file, std::as_bytes(std::span(text)));
    if (!written && !std::exchange(failed, true))
      log->warn("{} is not written, and what it keeps is lost with the daemon's end: {}", file.filename().string(),
                written.error().message);
    if (written) {
      failed = false;
    } else {
      // What it was some time ago would be believed after a restart: better nothing.
      std::error_code gone;
      std::filesystem::remove(file, gone);
    }
  }
};

KeptFile::KeptFile(std::filesystem::path file, Logger log)
    : state_(std::make_shared<State>(std::move(file), std::move(log))) {}

nlohmann::json KeptFile::read() const {
  std::ifstream in(state_->file, std::ios::binary);
  if (!in) return nullptr;
  nlohmann::json content = nlohmann::json::parse(in, nullptr, false);
  if (!content.is_discarded()) return content;
  state_->log->warn("{} cannot be read: what it kept is forgotten", state_->file.filename().string());
  return nullptr;
}

void KeptFile::write(Worker& worker, std::function<nlohmann::json()> content) {
  {
    const std::lock_guard lock(state_->mutex);
    if (std::exchange(state_->newest, std::move(content))) return;  // what is posted already takes it
  }
  worker.post([state = state_] { state->save(); });
}

}  // namespace veneer::daemon
