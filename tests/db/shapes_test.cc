// Shapes as they are stored: as short as can be, read exactly, and nothing else is taken for one.
#include "db/shapes.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace veneer::db {
namespace {

MicroPoint any_point() {
  const auto any = [] {
    const int digits = *rc::gen::inRange(1, 10);
    std::int64_t most = 1;
    for (int i = 0; i < digits; ++i) most *= 10;
    return *rc::gen::inRange<std::int64_t>(-most, most + 1);
  };
  return {any(), any()};
}
MicroRing any_ring() {
  MicroRing out;
  for (int i = 0, n = *rc::gen::inRange(1, 60); i < n; ++i) out.push_back(any_point());
  return out;
}

RC_GTEST_PROP(Shapes, AreReadAsTheyWereWritten, ()) {
  MicroArea area;
  for (int i = 0, n = *rc::gen::inRange(0, 5); i < n; ++i) area.rings.push_back(any_ring());
  const auto read = read_area(write_area(area));
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->rings == area.rings);
  const MicroRing ring = any_ring();
  RC_ASSERT(read_outline(write_outline(ring)) == ring);
  RC_ASSERT(read_ring(write_outline(ring)) == ring);
  RC_ASSERT(read_ring(write_ring(ring)) == ring);
}

// One letter more or less, or another one, is another shape or none, and is never written so.
RC_GTEST_PROP(Shapes, AreWrittenInOneWayOnly, ()) {
  std::string text = write_outline(any_ring());
  const auto at = *rc::gen::inRange<std::size_t>(0, text.size());
  const char letter = static_cast<char>(*rc::gen::inRange(32, 127));
  switch (*rc::gen::inRange(0, 3)) {
    case 0:
      text[at] = letter;
      break;
    case 1:
      text.insert(at, 1, letter);
      break;
    default:
      text.erase(at, 1);
  }
  const auto read = read_area(text);
  const bool one_way = !read || text.front() != '=' || write_area(*read) == text;
  RC_ASSERT(one_way);
}

TEST(Shapes, AreTheLettersOfThePage) {
  EXPECT_EQ(write_outline({{0, 0}, {10, 0}, {10, 10}}), "=??S??S");
  EXPECT_EQ(write_outline({{-1, 16}}), "=@_@") << "-1 is 1, 16 is 32: digits 0 and 1";
  EXPECT_EQ(write_area({}), "~");
  EXPECT_EQ(write_outline({}), "~");
}

TEST(Shapes, OlderOnesAreRead) {
  const MicroRing ring = {{0, 0}, {10, 0}, {10, 10}};
  for (const char* text : {"~0,0 10,0 0,10", "[[[0,0],[10,0],[10,10]]]"}) EXPECT_EQ(read_area(text)->rings.at(0), ring);
  EXPECT_EQ(read_outline("~0,0 10,0 0,10"), ring);
  EXPECT_EQ(read_ring("[[0,0],[10,0],[10,10]]"), ring);
  EXPECT_TRUE(read_ring("[]")->empty());
}

TEST(Shapes, NothingElseIsTakenForOne) {
  for (const char* text :
       {"", "=", "=?", "=??;", "=;??", "=??S", "=_?", "=?_?", "=?? ??", "=?????????x", "~0,0 9,0 0,9;", "[[0,0]"})
    EXPECT_FALSE(read_area(text)) << text;
  EXPECT_FALSE(read_outline("=??;??")) << "two rings";
  EXPECT_FALSE(read_area("=" + std::string(7, '~') + "?")) << "no step is as long";
}

}  // namespace
}  // namespace veneer::db
