// What a process has had of processors, as the kernel counts it: of the whole process, threads that have ended
// included, and of each thread that is there.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>

namespace veneer::tests {

// One line of /proc/PID/stat or /proc/PID/task/TID/stat.
struct ProcessorTime {
  std::string name;  // of the program or thread
  double seconds = 0;
};
inline std::optional<ProcessorTime> read_processor_time(const std::filesystem::path& stat) {
  std::ifstream file(stat);
  std::string line;
  std::getline(file, line);
  const auto open = line.find('('), close = line.rfind(')');
  if (open == std::string::npos || close == std::string::npos) return std::nullopt;
  std::istringstream rest(line.substr(close + 1));
  std::string skipped;
  for (int field = 3; field < 14; ++field) rest >> skipped;
  double user = 0, system = 0;
  if (!(rest >> user >> system)) return std::nullopt;
  return ProcessorTime{line.substr(open + 1, close - open - 1),
                       (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK))};
}

// Of all its threads together, those that have ended included; none where there is no such process.
inline std::optional<double> processor_seconds(pid_t pid) {
  const auto time = read_processor_time("/proc/" + std::to_string(pid) + "/stat");
  return time ? std::optional(time->seconds) : std::nullopt;
}

// Of each thread that is there, by its number. Threads that end between two looks are in no difference of these.
inline std::map<std::string, ProcessorTime> thread_times(pid_t pid) {
  std::map<std::string, ProcessorTime> out;
  std::error_code none;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task", none))
    if (auto time = read_processor_time(task.path() / "stat")) out[task.path().filename().string()] = *std::move(time);
  return out;
}

}  // namespace veneer::tests
