// What the daemon packs, unpacked by gzip's own program, which knows nothing of how it was packed.
#include "daemon/api/gzip.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/api_server.h"
#include "tests/support/http_probe.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using testing::ApiServer;
using testing::HttpProbe;

std::string unpacked_by_gzip(const std::string& packed) {
  const testing::TempDirectory folder;
  const std::string from = folder / "packed.gz", to = folder / "unpacked";
  std::ofstream(from, std::ios::binary) << packed;
  const std::string command = "gzip -dc '" + from + "' > '" + to + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe,cert-env33-c): one thread
  std::ifstream file(to, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Gzip, IsTakenByThoseWhoSaySo) {
  for (const char* yes : {"gzip", "gzip, deflate, br, zstd", "deflate;q=1.0, GZIP;q=0.5", "*", "br;q=0.2 , * ; q=0.1",
                          "gzip;q=0.001", "*;q=0, gzip"}) {
    EXPECT_TRUE(accepts_gzip(yes)) << yes;
  }
  for (const char* no :
       {"", "identity", "br", "gzip;q=0", "gzip;Q=0.000, *", "*;q=0", "x-gzipped", "\"gzip\"", ";;;gzip", "\xff\xfe"}) {
    EXPECT_FALSE(accepts_gzip(no)) << no;
  }
}

TEST(Gzip, PacksAnything) {
  std::string mixed;
  for (unsigned i = 0; i < 70'000; ++i) mixed += static_cast<char>(i * i / 7);
  for (const std::string& content : {std::string(), std::string("a"), std::string(100'000, 'x'), mixed}) {
    EXPECT_EQ(unpacked_by_gzip(gzipped(content)), content);
  }
  EXPECT_EQ(gzipped(mixed), gzipped(mixed));
}

TEST(Gzip, ThePageComesPackedToThoseWhoCanUnpackIt) {
  ApiServer server;
  auto probe = HttpProbe::over_unix(server.socket());
  const auto asked = [&probe](const std::string& headers) {
    return probe.ask("GET /console HTTP/1.1\r\nHost: x\r\n" + headers + "\r\n");
  };
  const auto plain = asked("");
  const auto packed = asked("Accept-Encoding: gzip, deflate, br\r\n");
  EXPECT_EQ(plain.header("Content-Encoding"), "");
  EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
  EXPECT_EQ(packed.header("Content-Type"), plain.header("Content-Type"));
  EXPECT_EQ(unpacked_by_gzip(packed.body), plain.body);
  EXPECT_LT(packed.body.size(), plain.body.size());
  for (const auto& answer : {plain, packed}) EXPECT_EQ(answer.header("Vary"), "Accept-Encoding");

  // Two texts to a cache between them and the browser: each is known by its own name only.
  EXPECT_NE(packed.header("ETag"), plain.header("ETag"));
  EXPECT_EQ(asked("Accept-Encoding: gzip\r\nIf-None-Match: " + packed.header("ETag") + "\r\n").status, 304);
  EXPECT_EQ(asked("If-None-Match: " + plain.header("ETag") + "\r\n").status, 304);
  EXPECT_EQ(asked("If-None-Match: " + packed.header("ETag") + "\r\n").status, 200);
}

}  // namespace
}  // namespace veneer::daemon
