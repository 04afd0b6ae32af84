#include "cli/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>

#include "base/utf8.h"

namespace veneer::cli {
namespace {

std::atomic<bool> g_interrupted = false;  // lock-free, so a signal handler may write to it
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void note_interrupt(int) { g_interrupted = true; }

int terminal_columns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

// Cuts at a character's edge, UTF-8 kept whole.
std::string shortened(const std::string& text, std::size_t columns) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (begins_character(text[i]) && seen++ == columns) return text.substr(0, i);
  }
  return text;
}

}  // namespace

std::string progress_line(double fraction, const std::string& text, int columns) {
  constexpr int kBar = 24;
  const int percent = static_cast<int>(std::floor(std::clamp(fraction, 0.0, 1.0) * 100));
  const int full = percent * kBar / 100;
  std::string number = std::to_string(percent);
  number.insert(0, 3 - std::min<std::size_t>(3, number.size()), ' ');
  std::string bar = "[" + std::string(static_cast<std::size_t>(full), '#') +
                    std::string(static_cast<std::size_t>(kBar - full), '-') + "] " + number + " %";
  const int left = columns - static_cast<int>(bar.size()) - 3;
  if (left < 8) return bar;
  return bar + "  " + shortened(text, static_cast<std::size_t>(left));
}

Progress::Style Progress::style_of_stderr() { return isatty(STDERR_FILENO) != 0 ? Style::kTerminal : Style::kPlain; }

bool Progress::is_news(double fraction, const std::string& text) {
  const auto without_numbers = [](std::string words) {
    std::erase_if(words, [](char c) { return c >= '0' && c <= '9'; });
    return words;
  };
  if (text.empty() || text == last_) return false;
  if (without_numbers(text) == without_numbers(last_) && fraction < last_fraction_ + 0.1) return false;
  last_ = text;
  last_fraction_ = fraction;
  return true;
}

void Progress::show(double fraction, const std::string& text) {
  if (style_ == Style::kPlain) {
    if (is_news(fraction, text)) out_ << text << std::endl;
    return;
  }
  const std::string line = progress_line(fraction, text, terminal_columns());
  if (line == last_) return;
  last_ = line;
  out_ << "\r\033[K" << line << std::flush;
}

Progress::~Progress() {
  if (style_ == Style::kTerminal && !last_.empty()) out_ << "\r\033[K" << std::flush;
}

InterruptGuard::InterruptGuard() {
  g_interrupted = false;
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  // A write to stderr that the signal meets is not given up: what is to be said about the stop would be lost with it.
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
}

InterruptGuard::~InterruptGuard() { signal(SIGINT, SIG_DFL); }

bool InterruptGuard::interrupted() { return g_interrupted; }

}  // namespace veneer::cli
