#include "daemon/workers/worker_processes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "base/json_depth.h"
#include "base/utf8.h"
#include "daemon/workers/error_json.h"
#include "daemon/workers/work_server.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using SteadyTime = std::chrono::steady_clock::time_point;

constexpr std::size_t kLongestLine = 4 << 20;
constexpr std::chrono::milliseconds kDiskLook{200};

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& o) noexcept : fd_(std::exchange(o.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& o) noexcept {
    std::swap(fd_, o.fd_);
    return *this;
  }
  ~Descriptor() { close(); }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

struct Pipe {
  Descriptor read, write;
};
std::optional<Pipe> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}
// A pipe whose end nobody reads kills who writes to it unless SIGPIPE is ignored; a socket can be asked not to.
std::optional<Pipe> make_pipe_that_does_not_signal() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return std::nullopt;
  return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}

// Nothing of the daemon's surroundings but what libraries and sanitizers need.
std::vector<std::string> small_environment() {
  std::vector<std::string> out;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const std::string_view name = text.substr(0, text.find('='));
    if (name == "PATH" || name == "LANG" || name.starts_with("LC_") || name.ends_with("SAN_OPTIONS"))
      out.emplace_back(text);
  }
  return out;
}

// A started process; killed and reaped at the latest when this goes.
class Child {
 public:
  static Result<Child> start(const std::filesystem::path& program, int requests, int answers) {
    posix_spawn_file_actions_t files;
    posix_spawnattr_t how;
    if (::posix_spawn_file_actions_init(&files) != 0) return cannot_start(program, ENOMEM);
    if (::posix_spawnattr_init(&how) != 0) {
      ::posix_spawn_file_actions_destroy(&files);
      return cannot_start(program, ENOMEM);
    }
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    int failed = ::posix_spawn_file_actions_adddup2(&files, requests, kWorkRequests);
    if (failed == 0) failed = ::posix_spawn_file_actions_adddup2(&files, STDERR_FILENO, STDOUT_FILENO);
    if (failed == 0) failed = ::posix_spawn_file_actions_adddup2(&files, answers, kWorkAnswers);
    if (failed == 0) failed = ::posix_spawn_file_actions_addclosefrom_np(&files, kWorkAnswers + 1);
    if (failed == 0) failed = ::posix_spawnattr_setsigmask(&how, &none);
    if (failed == 0) failed = ::posix_spawnattr_setsigdefault(&how, &all);
    // A group of its own: what a terminal sends to the daemon is for the daemon.
    if (failed == 0)
      failed = ::posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    std::string name = program.string();
    std::vector<std::string> environment = small_environment();
    std::vector<char*> arguments{name.data(), nullptr}, variables;
    for (auto& entry : environment) variables.push_back(entry.data());
    variables.push_back(nullptr);
    pid_t pid = 0;
    if (failed == 0) failed = ::posix_spawn(&pid, name.c_str(), &files, &how, arguments.data(), variables.data());
    ::posix_spawnattr_destroy(&how);
    ::posix_spawn_file_actions_destroy(&files);
    if (failed != 0) return cannot_start(program, failed);
    return Child(pid);
  }
  Child(Child&& o) noexcept : pid_(std::exchange(o.pid_, 0)) {}
  Child& operator=(Child&&) = delete;
  ~Child() { end(); }

  pid_t pid() const { return pid_; }
  // Ends it; how it had ended if it had already, as waitpid() tells it.
  int end() {
    if (pid_ == 0) return 0;
    ::kill(pid_, SIGKILL);
    int how = 0;
    while (::waitpid(pid_, &how, 0) < 0 && errno == EINTR) {
    }
    pid_ = 0;
    return how;
  }

 private:
  explicit Child(pid_t pid) : pid_(pid) {}
  static Error cannot_start(const std::filesystem::path& program, int why) {
    return {ErrorCode::kUnavailable,
            fmt::format("{} cannot be started ({}): install it beside veneerd, or free memory, then try again",
                        program.string(), std::generic_category().message(why))};
  }
  pid_t pid_;
};

struct Nonsense {};
struct OutOfMemory {};
struct Progressed {
  double fraction = 0;
  std::string text;
};
using Message = std::variant<Nonsense, OutOfMemory, Progressed, Result<json>>;

// Of what a process says to people.
std::string cut_to(std::string_view text, std::size_t most) { return std::string(beginning_of(text, most)); }

Message message_of(std::string_view line) {
  constexpr std::size_t kMostOfProgress = 200, kMostOfAnError = 4000;
  if (nested_too_deeply(line)) return Nonsense{};
  json said = json::parse(line, nullptr, false);
  if (!said.is_object()) return Nonsense{};
  if (const auto done = said.find("done"); done != said.end()) return Result<json>(std::move(*done));
  if (const auto failed = said.find("error"); failed != said.end()) {
    auto error = error_from_json(*failed);
    if (!error) return Nonsense{};
    error->message = cut_to(error->message, kMostOfAnError);
    return Result<json>(std::move(*error));
  }
  if (said.contains("out_of_memory")) return OutOfMemory{};
  const auto fraction = said.find("progress"), text = said.find("text");
  if (fraction == said.end() || !fraction->is_number() || text == said.end() || !text->is_string()) return Nonsense{};
  return Progressed{fraction->get<double>(), cut_to(text->get<std::string>(), kMostOfProgress)};
}

// One process and the talk with it.
class Conversation {
 public:
  Conversation(const WorkOrder& order, const WorkerProcessOptions& options, const TaskProgress& progress, int wake)
      : order_(order), options_(options), progress_(progress), wake_(wake) {}

  Result<json> hold(Child& child, Descriptor requests, Descriptor answers) {
    SteadyTime deadline = std::chrono::steady_clock::now() + order_.deadline;
    const std::uint64_t reserve = disk_reserve();
    SteadyTime disk_seen = std::chrono::steady_clock::now();
    rest_ = request_line();
    ::fcntl(requests.get(), F_SETFL, O_NONBLOCK);
    ::fcntl(answers.get(), F_SETFL, O_NONBLOCK);
    for (;;) {
      const SteadyTime now = std::chrono::steady_clock::now();
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - now);
      if (left.count() <= 0) {
        if (over_) return *over_;
        if (order_.grace.count() <= 0) return too_slow();
        deadline = tell_to_end(too_slow());
        continue;
      }
      if (now - disk_seen >= kDiskLook) {
        disk_seen = now;
        if (options_.free_space(order_.folder).value_or(reserve) < reserve) return fills_the_disk();
      }
      // The pipe for requests stays open: its end tells the process that nobody listens any more.
      std::array<pollfd, 3> wait{pollfd{answers.get(), POLLIN, 0}, pollfd{over_ ? -1 : wake_, POLLIN, 0},
                                 pollfd{rest_.empty() ? -1 : requests.get(), POLLOUT, 0}};
      const int ready = ::poll(wait.data(), wait.size(), static_cast<int>(std::min(left, kDiskLook).count()));
      if (ready < 0 && errno != EINTR)
        return Error{ErrorCode::kInternal, fmt::format("{} could not be followed: try again", order_.what)};
      if (ready <= 0) continue;
      if (wait[1].revents != 0) {
        Error cancelled{ErrorCode::kCancelled, fmt::format("{} was cancelled", order_.what)};
        if (order_.grace.count() <= 0) return cancelled;
        deadline = tell_to_end(std::move(cancelled));
        continue;
      }
      if (wait[2].revents != 0) send_rest(requests.get());
      if (wait[0].revents == 0) continue;
      auto answer = receive(answers.get());
      if (over_ && (answer || ended_)) return *over_;
      if (answer) return std::move(*answer);
      if (ended_) return without_answer(child.end());
    }
  }

 private:
  std::string request_line() const {
    json order{{"kind", order_.kind},       {"what", order_.what},       {"folder", order_.folder.string()},
               {"readable", json::array()}, {"writable", json::array()}, {"memory_bytes", options_.memory_bytes},
               {"nice", order_.nice},       {"network", order_.network}, {"request", order_.request}};
    if (order_.devices) {
      order["devices"] = json::array();
      for (const auto& path : *order_.devices) order["devices"].push_back(path.string());
    }
    for (const auto& path : order_.readable) order["readable"].push_back(path.string());
    for (const auto& path : order_.writable) order["writable"].push_back(path.string());
    return order.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
  }

  // Whatever it answers then, this is how it ended. Until when it has.
  SteadyTime tell_to_end(Error why) {
    over_ = std::move(why);
    rest_ += "stop\n";
    return std::chrono::steady_clock::now() + order_.grace;
  }

  void send_rest(int to) {
    // A process that does not read any more is about to end; receive() will see it.
    const ssize_t n = ::send(to, rest_.data() + sent_, rest_.size() - sent_, MSG_NOSIGNAL);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (n < 0) sent_ = rest_.size();
    if (n > 0) sent_ += static_cast<std::size_t>(n);
    if (sent_ == rest_.size()) rest_.clear(), sent_ = 0;
  }

  std::optional<Result<json>> receive(int from) {
    std::array<char, 1 << 16> chunk{};
    const ssize_t n = ::read(from, chunk.data(), chunk.size());
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
    if (n <= 0) {
      ended_ = true;
      return std::nullopt;
    }
    line_.append(chunk.data(), static_cast<std::size_t>(n));
    std::size_t begin = 0;
    for (std::size_t end = 0; (end = line_.find('\n', begin)) != std::string::npos; begin = end + 1) {
      auto said = message_of(std::string_view(line_).substr(begin, end - begin));
      if (auto* progressed = std::get_if<Progressed>(&said)) {
        if (progress_) progress_(progressed->fraction, progressed->text);
      } else if (std::holds_alternative<OutOfMemory>(said)) {
        return Result<json>(needs_more());
      } else if (auto* result = std::get_if<Result<json>>(&said)) {
        return std::move(*result);
      } else {
        return Result<json>(nonsense());
      }
    }
    line_.erase(0, begin);
    if (line_.size() > kLongestLine) return Result<json>(nonsense());
    return std::nullopt;
  }

  Error too_slow() const {
    return {ErrorCode::kTimeout,
            fmt::format("{} took longer than {} s and was ended: ask for something smaller, or allow more time in "
                        "[workers] of the configuration",
                        order_.what, std::chrono::duration<double>(order_.deadline).count())};
  }
  // What must stay free: enough for the ledger of many jobs, and on a small disk half of what there was.
  std::uint64_t disk_reserve() const {
    constexpr std::uint64_t kForTheLedger = 256 << 20;
    return std::min(kForTheLedger, options_.free_space(order_.folder).value_or(0) / 2);
  }

  Error fills_the_disk() const {
    return {ErrorCode::kStorage,
            fmt::format("{} was ended because the disk is nearly full, and the ledger needs what is left: make room on "
                        "it, then try again",
                        order_.what)};
  }
  Error needs_more() const {
    return {ErrorCode::kUnavailable,
            fmt::format("{} needs more memory than the {} MB a worker may take: ask for something smaller, or raise "
                        "memory_mb in [workers] of the configuration",
                        order_.what, options_.memory_bytes >> 20)};
  }
  Error nonsense() const {
    return {ErrorCode::kInternal,
            fmt::format("{} was broken off, because its process answered nonsense: try again, and report it when it "
                        "comes back",
                        order_.what)};
  }
  Error without_answer(int how) const {
    if (WIFSIGNALED(how) && WTERMSIG(how) == SIGKILL)
      return {ErrorCode::kUnavailable,
              fmt::format("{} was broken off, because its process was killed, most often for want of memory: close "
                          "other programs or ask for something smaller, then try again",
                          order_.what)};
    const std::string end = WIFSIGNALED(how) ? fmt::format("crashed with signal {}", WTERMSIG(how))
                                             : fmt::format("ended with status {}", WEXITSTATUS(how));
    return {ErrorCode::kInternal,
            fmt::format("{} was broken off, because its process {}: try again, with another picture or another scan "
                        "when it comes back",
                        order_.what, end)};
  }

  const WorkOrder& order_;
  const WorkerProcessOptions& options_;
  const TaskProgress& progress_;
  int wake_;
  std::string rest_;  // of the request, to be sent from `sent_` on
  std::size_t sent_ = 0;
  std::string line_;
  bool ended_ = false;
  std::optional<Error> over_;  // it was told to end, and why
};

}  // namespace

WorkerProcesses::WorkerProcesses(WorkerProcessOptions options, Logger log)
    : options_(std::move(options)), log_(std::move(log)) {}

Result<json> WorkerProcesses::run(const WorkOrder& order, const TaskProgress& progress, std::stop_token stop) {
  const Descriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  auto requests = make_pipe_that_does_not_signal(), answers = make_pipe();
  if (wake.get() < 0 || !requests || !answers)
    return Error{ErrorCode::kUnavailable,
                 fmt::format("{} cannot begin, because too many files are open: try again later", order.what)};
  auto child = Child::start(options_.program, requests->read.get(), answers->write.get());
  if (!child) return child.error();
  requests->read.close();
  answers->write.close();
  const pid_t pid = child->pid();
  if (options_.on_start) options_.on_start(pid);
  const std::stop_callback on_stop(stop, [&wake] {
    const std::uint64_t one = 1;
    static_cast<void>(::write(wake.get(), &one, sizeof one) > 0);  // an eventfd takes it, or holds one already
  });
  auto result = Conversation(order, options_, progress, wake.get())
                    .hold(*child, std::move(requests->write), std::move(answers->read));
  if (!result && result.error().code != ErrorCode::kCancelled)
    log_->info("worker {} ({}): {}", pid, order.kind, result.error().message);
  return result;
}

std::optional<std::uint64_t> free_on_disk(const std::filesystem::path& folder) {
  std::error_code failed;
  const auto space = std::filesystem::space(folder, failed);
  if (failed) return std::nullopt;
  return space.available;
}

std::filesystem::path worker_program() {
  std::error_code failed;
  return std::filesystem::read_symlink("/proc/self/exe", failed).parent_path() / "veneer-worker";
}

std::uint64_t usual_worker_memory() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
  return pages <= 0 || size <= 0 ? 0 : static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(size) / 4 * 3;
}

}  // namespace veneer::daemon
