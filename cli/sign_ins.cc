#include "cli/sign_ins.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace veneer::cli {
namespace {

namespace fs = std::filesystem;

fs::path kept_in() {
  // One thread, and nobody changes them.
  const char* config = std::getenv("XDG_CONFIG_HOME");  // NOLINT(concurrency-mt-unsafe)
  const char* home = std::getenv("HOME");               // NOLINT(concurrency-mt-unsafe)
  if (config != nullptr && *config == '/') return fs::path(config) / "veneerctl" / "sign-ins.json";
  if (home != nullptr && *home == '/') return fs::path(home) / ".config" / "veneerctl" / "sign-ins.json";
  return {};
}

nlohmann::json all_kept(const fs::path& file) {
  std::ifstream in(file);
  nlohmann::json kept = nlohmann::json::parse(in, nullptr, false);
  return kept.is_object() ? kept : nlohmann::json::object();
}

Error not_kept(const fs::path& file) {
  return Error{ErrorCode::kStorage, fmt::format("cannot keep the sign-in in {}: use VENEERD_TOKEN with a token of "
                                                "`veneerctl token new` instead",
                                                file.empty() ? "a folder of yours (HOME is not set)" : file.string())};
}

}  // namespace

std::string kept_secret(const std::string& address) {
  const fs::path file = kept_in();
  if (file.empty()) return {};
  const auto kept = all_kept(file);
  const auto found = kept.find(address);
  return found != kept.end() && found->is_string() ? found->get<std::string>() : "";
}

Status keep_secret(const std::string& address, const std::string& secret) {
  const fs::path file = kept_in();
  if (file.empty()) return not_kept(file);
  nlohmann::json kept = all_kept(file);
  if (secret.empty())
    kept.erase(address);
  else
    kept[address] = secret;
  std::error_code fault;
  fs::create_directories(file.parent_path(), fault);
  const std::string made = file.string() + ".new", text = kept.dump(1) + "\n";
  ::unlink(made.c_str());
  const int descriptor = ::open(made.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) return not_kept(file);
  const bool written = ::write(descriptor, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const bool closed = ::close(descriptor) == 0;
  if (!written || !closed || std::rename(made.c_str(), file.c_str()) != 0) return not_kept(file);
  return Ok();
}

}  // namespace veneer::cli
