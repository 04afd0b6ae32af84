// A table as plain text, its columns padded to the width of their widest cell.
#pragma once

#include <string>
#include <vector>

namespace veneer::cli {

class TextTable {
 public:
  // A heading that begins with '>' is a column of numbers, aligned to the right.
  explicit TextTable(std::vector<std::string> headings);
  void add(std::vector<std::string> row);
  std::string str() const;

 private:
  std::vector<bool> right_;
  std::vector<std::vector<std::string>> rows_;
};

// Characters, not bytes, of UTF-8.
std::size_t width_of(const std::string& text);

}  // namespace veneer::cli
