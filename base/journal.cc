#include "base/journal.h"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

namespace veneer {
namespace {

thread_local const LogFields* about = nullptr;

// A name, and a value that may hold anything: its length goes before it, 64 bits, the lowest byte first.
void add_field(std::string& out, std::string_view name, std::string_view value) {
  if (value.empty()) return;
  out.append(name).push_back('\n');
  for (int byte = 0; byte < 8; ++byte)
    out.push_back(static_cast<char>((static_cast<std::uint64_t>(value.size()) >> (8 * byte)) & 0xffU));
  out.append(value).push_back('\n');
}

std::optional<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return std::nullopt;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  JournalSink(int socket, const sockaddr_un& journal) : socket_(socket), journal_(journal) {}
  ~JournalSink() override { ::close(socket_); }

 private:
  static constexpr std::size_t kLongestLine = 4096;

  void sink_it_(const spdlog::details::log_msg& msg) override {
    if (lost_ > 0) {
      const std::string lines = fmt::format("({} lines of this log were lost: the journal had no room)", lost_);
      if (!send_now(msg, lines, nullptr)) {
        ++lost_;
        return;
      }
      lost_ = 0;
    }
    const std::string_view line(msg.payload.data(), std::min(msg.payload.size(), kLongestLine));
    if (!send_now(msg, line, about)) ++lost_;
  }
  void flush_() override {}

  bool send_now(const spdlog::details::log_msg& msg, std::string_view line, const LogFields* fields) const {
    static constexpr std::string_view kPriority = "7764326";
    std::string out;
    add_field(out, "MESSAGE", line.empty() ? " " : line);
    add_field(out, "PRIORITY", kPriority.substr(static_cast<std::size_t>(msg.level), 1));
    add_field(out, "SYSLOG_IDENTIFIER", {msg.logger_name.data(), msg.logger_name.size()});
    if (fields) {
      add_field(out, "VENEER_JOB", fields->job);
      add_field(out, "VENEER_PANEL", fields->panel);
      add_field(out, "VENEER_PIECE", fields->piece);
      add_field(out, "VENEER_WHO", fields->who);
    }
    // The address each time: a journal that was restarted has another socket there.
    return ::sendto(socket_, out.data(), out.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                    reinterpret_cast<const sockaddr*>(&journal_), sizeof journal_) >= 0;
  }

  const int socket_;
  const sockaddr_un journal_;
  std::size_t lost_ = 0;
};

}  // namespace

LogAbout::LogAbout(LogFields fields) : fields_(std::move(fields)), outer_(about) { about = &fields_; }
LogAbout::~LogAbout() { about = outer_; }

Logger make_journal_logger(const char* name, const std::string& path) {
  const auto address = address_of(path);
  const int socket =
      address && ::access(path.c_str(), W_OK) == 0 ? ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0) : -1;
  if (socket < 0) return make_stderr_logger(name, true);
  return std::make_shared<spdlog::logger>(name, std::make_shared<JournalSink>(socket, *address));
}

}  // namespace veneer
