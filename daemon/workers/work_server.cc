#include "daemon/workers/work_server.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <exception>
#include <new>
#include <string_view>
#include <thread>
#include <utility>

#include "daemon/workers/confinement.h"
#include "daemon/workers/error_json.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

enum ExitStatus { kAnswered = 0, kNoOrder = 2, kNobodyListens = 3 };

void say(const json& message) {
  const std::string line = message.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t n = ::write(kWorkAnswers, line.data() + done, line.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) ::_exit(kNobodyListens);
    done += static_cast<std::size_t>(n);
  }
}

// Up to the end of the line; what has come behind it already says that the work is over.
std::string read_order(std::stop_source& stop) {
  std::string order;
  std::array<char, 1 << 16> chunk{};
  std::size_t end = std::string::npos;
  while (end == std::string::npos) {
    const ssize_t n = ::read(kWorkRequests, chunk.data(), chunk.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) ::_exit(kNoOrder);
    const std::size_t begin = order.size();
    order.append(chunk.data(), static_cast<std::size_t>(n));
    end = order.find('\n', begin);
  }
  if (end + 1 < order.size()) stop.request_stop();
  order.resize(end);
  return order;
}

void end_when_nobody_listens(std::stop_source stop) {
  std::thread([stop = std::move(stop)]() mutable {
    char byte = 0;
    for (ssize_t n = 1; n > 0 || (n < 0 && errno == EINTR);) {
      n = ::read(kWorkRequests, &byte, 1);
      if (n > 0) stop.request_stop();
    }
    ::_exit(kNobodyListens);
  }).detach();
}

// Passes on what has changed, at most some twenty times a second.
class Reporter {
 public:
  void operator()(double fraction, const std::string& text) {
    const auto now = std::chrono::steady_clock::now();
    if (text == last_text_ && now - last_ < std::chrono::milliseconds(50)) return;
    last_ = now;
    last_text_ = text;
    say({{"progress", fraction}, {"text", text}});
  }

 private:
  std::chrono::steady_clock::time_point last_;
  std::string last_text_;
};

std::vector<std::filesystem::path> paths_of(const json& list) {
  std::vector<std::filesystem::path> out;
  for (const auto& path : list) out.emplace_back(path.get<std::string>());
  return out;
}

json answer(const DoWork& work) {
  std::string what = "the work";
  try {
    std::stop_source stop;
    const json order = json::parse(read_order(stop));
    what = order.at("what").get<std::string>();
    const std::filesystem::path folder = order.at("folder").get<std::string>();
    Confinement limits;
    limits.memory_bytes = order.at("memory_bytes").get<std::uint64_t>();
    limits.nice = order.at("nice").get<int>();
    limits.readable = paths_of(order.at("readable"));
    limits.writable = paths_of(order.at("writable"));
    limits.writable.push_back(folder);
    if (const auto devices = order.find("devices"); devices != order.end()) limits.devices = paths_of(*devices);
    // A daemon that still runs while an update replaces this program may not know the word.
    limits.network = order.value("network", false);
    if (const Status confined = confine(limits); !confined) return {{"error", error_to_json(confined.error())}};
    end_when_nobody_listens(stop);
    Reporter reporter;
    auto result =
        work(order.at("kind").get<std::string>(), order.at("request"), folder, std::ref(reporter), stop.get_token());
    if (!result) return {{"error", error_to_json(result.error())}};
    return {{"done", std::move(*result)}};
  } catch (const std::bad_alloc&) {
    return {{"out_of_memory", true}};
  } catch (const std::exception& e) {
    return {{"error", error_to_json({ErrorCode::kInternal,
                                     fmt::format("{} ended with an error of the program ({}): try again, and report "
                                                 "it when it comes back",
                                                 what, e.what())})}};
  }
}

}  // namespace

void serve_work(const DoWork& work) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGPIPE, SIG_IGN);
  say(answer(work));
  // Threads of libraries may still run: nothing is torn down.
  ::_exit(kAnswered);
}

}  // namespace veneer::daemon
