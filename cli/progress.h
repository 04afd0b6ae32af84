// Progress of long work: one line that fills up on a terminal, a plain line per change of text elsewhere
// (where only its numbers change, one per tenth of the way).
#pragma once

#include <ostream>
#include <string>

namespace veneer::cli {

// One rendered line, at most `columns` wide: "matching patches  [#######-------]  49 %".
std::string progress_line(double fraction, const std::string& text, int columns);

class Progress {
 public:
  enum class Style { kTerminal, kPlain };
  static Style style_of_stderr();

  Progress(std::ostream& out, Style style) : out_(out), style_(style) {}
  ~Progress();  // leaves a clean line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(double fraction, const std::string& text);

 private:
  bool is_news(double fraction, const std::string& text);

  std::ostream& out_;
  Style style_;
  std::string last_;
  double last_fraction_ = 0;
};

// While it lives the first Ctrl-C only sets a flag; the second ends the program.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  static bool interrupted();
};

}  // namespace veneer::cli
