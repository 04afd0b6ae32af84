#include "tests/support/program_start.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <string>

#include "base/sanitized.h"

#ifdef VENEER_SANITIZED
#include <sanitizer/allocator_interface.h>
#endif

namespace veneer::tests {
namespace {

struct Said {
  int status = -1;
  std::string words;
};

Said said_by(const ProgramStart& program) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  const pid_t child = program.run(ends[1], ends[1]);
  close(ends[1]);
  Said out;
  char byte = 0;
  while (read(ends[0], &byte, 1) == 1) out.words += byte;
  close(ends[0]);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  if (WIFEXITED(status)) out.status = WEXITSTATUS(status);
  return out;
}

TEST(ProgramStart, HandsOnArgumentsAndEnvironment) {
  const Said said = said_by(ProgramStart({"/bin/sh", "-c", "echo \"$0 $WOOD $HOME\"; exit 3", "a b"},
                                         {{"WOOD", "oak"}, {"HOME", "/elsewhere"}}));
  EXPECT_EQ(said.words, "a b oak /elsewhere\n");
  EXPECT_EQ(said.status, 3);
}

TEST(ProgramStart, GivesNothingToRead) { EXPECT_EQ(said_by(ProgramStart({"/bin/cat"})).words, ""); }

TEST(ProgramStart, NamesAProgramThatIsNotThere) {
  const Said said = said_by(ProgramStart({"/nowhere/program"}));
  EXPECT_EQ(said.words, "cannot start /nowhere/program\n");
  EXPECT_EQ(said.status, 127);
}

#ifdef VENEER_SANITIZED
// Shared with the child.
std::atomic<int>* allocated_by_children = nullptr;
pid_t parent = 0;

void count_of_child(const volatile void*, std::size_t) {
  if (getpid() != parent) ++*allocated_by_children;
}
void ignore(const volatile void*) {}

TEST(ProgramStart, AllocatesNothingInTheForkedChild) {
  void* shared = mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  allocated_by_children = new (shared) std::atomic<int>(0);
  parent = getpid();
  ASSERT_GT(__sanitizer_install_malloc_and_free_hooks(count_of_child, ignore), 0);
  EXPECT_EQ(said_by(ProgramStart({"/bin/sh", "-c", "echo $WOOD"}, {{"WOOD", "oak"}})).words, "oak\n");
  EXPECT_EQ(said_by(ProgramStart({"/nowhere/program"})).status, 127);
  EXPECT_EQ(*allocated_by_children, 0);
}
#endif

}  // namespace
}  // namespace veneer::tests
