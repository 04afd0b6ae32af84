// veneer-worker with a fault that its surroundings ask for: three words in the file "fault" beside the program, read
// before anything else: the fault, the kind of work that has it, and after how many milliseconds of that work.
// Otherwise it is veneer-worker. With --kinds it says which kinds of work there are, one a line.
//
// Whatever it does, it does as a real one would: confined, in the midst of a real order.
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "daemon/orders/every_work.h"
#include "daemon/workers/work_server.h"

namespace {

using namespace veneer;
using namespace veneer::daemon;

struct Fault {
  std::string what, kind;
  int after_ms = 0;
};

Fault asked_for() {
  std::error_code failed;
  const auto beside = std::filesystem::read_symlink("/proc/self/exe", failed).parent_path() / "fault";
  std::ifstream file(beside);
  Fault out;
  file >> out.what >> out.kind >> out.after_ms;
  return out;
}

volatile char sink = 0;  // so that what is only written is not optimised away

void misbehave(const std::string& fault) {
  if (fault == "kill") ::raise(SIGKILL);
  if (fault == "crash") std::abort();
  if (fault == "leave") ::_exit(0);
  if (fault == "throw") throw std::vector<int>().at(1);
  if (fault == "garbage") {
    const std::string noise = "\x01\xff{\"progress\": [\n\n\"done\"}\n";
    static_cast<void>(!::write(kWorkAnswers, noise.data(), noise.size()));
  }
  if (fault == "flood")
    for (const std::string noise(1 << 16, 'x'); ::write(kWorkAnswers, noise.data(), noise.size()) > 0;) continue;
  if (fault == "hang")
    for (;;) ::pause();
  if (fault == "spin")
    for (;;) sink = static_cast<char>(sink + 1);
  if (fault == "memory")
    for (std::vector<std::vector<char>> all;;) {
      all.emplace_back(16 << 20, 'x');
      sink = all.back().back();
    }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--kinds") {
    for (const std::string& kind : kinds_of_work()) std::puts(kind.c_str());
    return 0;
  }
  const Fault fault = asked_for();
  const bool late = fault.what.starts_with("late-");
  const std::string what = late ? fault.what.substr(5) : fault.what;
  serve_work([&](const std::string& kind, const nlohmann::json& request, const std::filesystem::path& folder,
                 const TaskProgress& progress, const std::stop_token& stop) -> Result<nlohmann::json> {
    // In the midst of the work, if it takes that long.
    std::jthread fate;
    if (kind == fault.kind && !late && fault.after_ms > 0)
      fate = std::jthread([&](const std::stop_token& over) {
        std::mutex mutex;
        std::condition_variable_any waiting;
        std::unique_lock lock(mutex);
        if (!waiting.wait_for(lock, over, std::chrono::milliseconds(fault.after_ms), [] { return false; }) &&
            !over.stop_requested())
          misbehave(what);
      });
    else if (kind == fault.kind && !late)
      misbehave(what);
    auto done = do_any_work(kind, request, folder, progress, stop);
    if (kind == fault.kind && late) misbehave(what);
    return done;
  });
}
