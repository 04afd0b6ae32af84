// A small disk of the test's own, which can become full or read-only: a tmpfs that only a child process sees. Needs the
// system's leave (root, or user namespaces). Without it such tests are skipped, which ctest tells; where the variable
// VENEER_MOUNTS says more than nothing they fail, so that whoever knows that a machine gives it never loses them
// unseen. `./dev test` sets it where a trial mount works.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>

namespace veneer::testing {

// At once after OwnDisk::run(), in a test.
#define VENEER_REQUIRE_DISK(said)                                                              \
  if (said) {                                                                                  \
  } else if (veneer::testing::OwnDisk::is_promised()) {                                        \
    FAIL() << "nobody may mount a disk here, and VENEER_MOUNTS says that it must be possible"; \
  } else                                                                                       \
    GTEST_SKIP() << "nobody may mount a disk here: run this as root, or allow user namespaces"

class OwnDisk {
 public:
  // What `body` says, run in a process that has a disk of this size at `folder`, an empty folder; nullopt where the
  // system gives nobody a disk of his own.
  static std::optional<std::string> run(const std::filesystem::path& folder, std::size_t bytes,
                                        const std::function<std::string(const OwnDisk&)>& body) {
    int way[2];
    if (::pipe(way) != 0) std::abort();
    const pid_t child = ::fork();
    if (child < 0) std::abort();
    if (child == 0) {
      const OwnDisk disk(folder);
      const std::string said = disk.mount(bytes) ? "+" + body(disk) : "-";
      const bool told = ::write(way[1], said.data(), said.size()) == static_cast<ssize_t>(said.size());
      ::_exit(told ? 0 : 1);
    }
    ::close(way[1]);
    std::string said;
    char part[4096];
    for (ssize_t got = 0; (got = ::read(way[0], part, sizeof part)) > 0;)
      said.append(part, static_cast<std::size_t>(got));
    ::close(way[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || said.empty()) return "the child died";
    if (said[0] == '-') return std::nullopt;
    return said.substr(1);
  }

  // VENEER_MOUNTS says that it must be possible; set to nothing it does not.
  static bool is_promised() {
    const char* said = std::getenv("VENEER_MOUNTS");  // NOLINT(concurrency-mt-unsafe): nothing sets it
    return said != nullptr && *said != '\0';
  }

  void fill() const {
    std::ofstream filler(folder_ / "filler", std::ios::binary);
    const std::string page(4096, 'x');
    while (filler.write(page.data(), static_cast<std::streamsize>(page.size())).flush()) {
    }
  }
  // So many bytes are left, if there were more.
  void fill_but(std::uintmax_t left) const {
    const std::uintmax_t free = std::filesystem::space(folder_).available;
    if (free <= left) return;
    const int filler = ::open((folder_ / "filler").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (filler < 0 || ::posix_fallocate(filler, 0, static_cast<off_t>(free - left)) != 0) ::_exit(1);
    ::close(filler);
  }
  // Of what filled it.
  void empty() const { std::filesystem::remove(folder_ / "filler"); }
  // Nothing may be open for writing.
  void make_read_only() const {
    if (::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, nullptr) != 0) ::_exit(1);
  }

 private:
  explicit OwnDisk(std::filesystem::path folder) : folder_(std::move(folder)) {}
  bool mount(std::size_t bytes) const {
    if (::unshare(CLONE_NEWNS) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
    const std::string options = "size=" + std::to_string(bytes);
    return ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
           ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, options.c_str()) == 0;
  }

  std::filesystem::path folder_;
};

}  // namespace veneer::testing
