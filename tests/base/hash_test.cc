#include "base/hash.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string_view>

#include "tests/support/temp_directory.h"

namespace veneer {
namespace {

std::string hash_of(std::string_view text) { return sha256_hex(std::as_bytes(std::span(text))); }

// FIPS 180-4 examples.
TEST(Sha256, AgreesWithThePublishedVectors) {
  EXPECT_EQ(hash_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(hash_of(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, ThatIsStoppedIsNone) {
  const std::string bytes(3 * (1 << 20), 'x');
  std::stop_source stop;
  EXPECT_EQ(*sha256_hex(std::as_bytes(std::span(bytes)), stop.get_token()), hash_of(bytes));
  stop.request_stop();
  const Result<std::string> hash = sha256_hex(std::as_bytes(std::span(bytes)), stop.get_token());
  ASSERT_FALSE(hash.ok());
  EXPECT_EQ(hash.error().code, ErrorCode::kCancelled);
}

TEST(Sha256, OfAFileIsThatOfItsBytes) {
  const testing::TempDirectory directory;
  const std::string bytes(3 * (1 << 20) + 17, 'x');
  std::ofstream(directory / "scan.png", std::ios::binary) << bytes;
  const auto hash = sha256_hex_of_file(directory / "scan.png");
  ASSERT_TRUE(hash.ok());
  EXPECT_EQ(*hash, hash_of(bytes));
}

TEST(Sha256, NamesAFileThatCannotBeRead) {
  const auto hash = sha256_hex_of_file("/nowhere/scan.png");
  ASSERT_FALSE(hash.ok());
  EXPECT_EQ(hash.error().code, ErrorCode::kNotFound);
  EXPECT_NE(hash.error().message.find("/nowhere/scan.png"), std::string::npos);
}

}  // namespace
}  // namespace veneer
