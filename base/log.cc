#include "base/log.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/null_sink.h>
#include <unistd.h>

#include <climits>
#include <cstddef>
#include <mutex>
#include <string_view>

namespace veneer {
namespace {

// "<4>" for a warning, as sd-daemon(3) defines it.
class SyslogPriority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& msg, const std::tm&, spdlog::memory_buf_t& out) override {
    static constexpr char kPriority[] = {'7', '7', '6', '4', '3', '2', '6'};
    const char prefix[] = {'<', kPriority[msg.level], '>'};
    out.append(prefix, prefix + sizeof prefix);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<SyslogPriority>(); }
};

// A line that the reader has no room for is dropped and counted: whoever owns a laser must not wait for a journal.
class PromptSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit PromptSink(int descriptor) : descriptor_(descriptor) {}

 private:
  // A pipe that polls as writable takes so much without waiting.
  static constexpr std::size_t kMostAtOnce = PIPE_BUF;

  void sink_it_(const spdlog::details::log_msg& msg) override {
    if (lost_ > 0) {
      const std::string lines = fmt::format("({} lines of this log were lost: nobody read them)\n", lost_);
      if (!write_now(lines)) {
        ++lost_;
        return;
      }
      lost_ = 0;
    }
    spdlog::memory_buf_t line;
    formatter_->format(msg, line);
    if (line.size() > kMostAtOnce) {
      line.resize(kMostAtOnce);
      line[kMostAtOnce - 1] = '\n';
    }
    if (!write_now({line.data(), line.size()})) ++lost_;
  }
  void flush_() override {}

  bool write_now(std::string_view text) const {
    pollfd room{descriptor_, POLLOUT, 0};
    if (::poll(&room, 1, 0) <= 0 || (room.revents & POLLOUT) == 0) return false;
    return ::write(descriptor_, text.data(), text.size()) > 0;
  }

  const int descriptor_;
  std::size_t lost_ = 0;
};

}  // namespace

Logger make_logger(const char* name, bool journal, int descriptor) {
  auto logger = std::make_shared<spdlog::logger>(name, std::make_shared<PromptSink>(descriptor));
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<SyslogPriority>('J').set_pattern(journal ? "%J%v" : "%Y-%m-%dT%H:%M:%S.%e %l %n: %v");
  logger->set_formatter(std::move(formatter));
  return logger;
}

Logger make_stderr_logger(const char* name, bool journal) { return make_logger(name, journal, STDERR_FILENO); }

Logger make_null_logger() {
  return std::make_shared<spdlog::logger>("null", std::make_shared<spdlog::sinks::null_sink_mt>());
}

}  // namespace veneer
