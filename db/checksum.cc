#include "db/checksum.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <bit>
#include <cstdint>
#include <span>

namespace veneer::db {
namespace {

// FNV-1a, 64 bits.
class Fnv {
 public:
  void add(std::span<const unsigned char> bytes) {
    for (const unsigned char byte : bytes) state_ = (state_ ^ byte) * 0x100000001B3;
  }
  void add(std::uint64_t number) {
    unsigned char bytes[8];
    for (int i = 0; i < 8; ++i) bytes[i] = static_cast<unsigned char>(number >> (8 * i));
    add(std::span<const unsigned char>(bytes));
  }
  std::int64_t value() const { return std::bit_cast<std::int64_t>(state_); }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325;
};

void checksum_function(sqlite3_context* context, int count, sqlite3_value** values) {
  Fnv sum;
  for (int i = 0; i < count; ++i) {
    const int type = sqlite3_value_type(values[i]);
    sum.add(static_cast<std::uint64_t>(type));
    if (type == SQLITE_INTEGER) {
      sum.add(std::bit_cast<std::uint64_t>(sqlite3_value_int64(values[i])));
    } else if (type == SQLITE_FLOAT) {
      const double number = sqlite3_value_double(values[i]);
      sum.add(std::bit_cast<std::uint64_t>(number == 0 ? 0.0 : number));  // SQLite keeps no sign of a zero
    } else if (type != SQLITE_NULL) {
      const auto* bytes = static_cast<const unsigned char*>(sqlite3_value_blob(values[i]));
      const auto size = static_cast<std::size_t>(sqlite3_value_bytes(values[i]));
      sum.add(size);
      if (bytes != nullptr) sum.add({bytes, size});
    }
  }
  sqlite3_result_int64(context, sum.value());
}

}  // namespace

void register_checksum(SQLite::Database& connection) {
  connection.createFunction("veneer_checksum", -1, true, nullptr, &checksum_function);
}

}  // namespace veneer::db
