// Reads what is engraved on a piece's back as a stranger would: by OCR (tesseract), with no knowledge of the font, of
// the plan, or of which marks exist. All it is told is the grammar. Of marks that tell places: letters, a number, and
// maybe a hyphen and another number. Of short ones: up to four signs of an alphabet of 25, not all of them alike in a
// mirror. Either stands over a bar, on one line or on two.
//
// The bar is the longest straight stroke; the side the ink is on is the text's up. What reads well only in a mirror is
// reported as mirrored. Each character is set apart first; the letters are read among letters, the numbers among
// digits, at several sizes and stroke weights until two readings agree. Of a short mark two must agree of which one is
// sure (80 of 100), or else the text that is read most often counts, if at least twice and once with 40: where two
// texts are read as often as each other, none is.
//
// Threading: one reader per thread. Not re-entrant.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>

#include "base/result.h"
#include "drivers/sim/plane.h"

namespace veneer::proof {

enum class MarkGrammar { kPlace, kShort };

struct ReadMark {
  std::string text;  // "A3-12"
  bool mirrored = false;
  sim::Vec2 up{};         // unit vector of the text's up in the picture, +y up
  double confidence = 0;  // 0 to 100
};

// A text, as often as it was read at several sizes and weights.
struct Reading {
  std::string text;
  double confidence = 0;  // 0 to 100, of the surest of them
  int times = 0;
};
// The one with the most times; nothing where two draw, since nothing tells which is right.
std::optional<Reading> most_often(std::span<const Reading> readings);

class MarkReader {
 public:
  // kUnavailable when tesseract or its English data is not installed.
  static Result<std::unique_ptr<MarkReader>> create();
  ~MarkReader();
  MarkReader(const MarkReader&) = delete;
  MarkReader& operator=(const MarkReader&) = delete;

  // `back` as cut_out.h's back_picture gives it: grey, engraving and holes dark, white beside the piece. Nothing when
  // no bar or no reading that fits the grammar was found.
  std::optional<ReadMark> read(const cv::Mat& back, double px_per_mm, MarkGrammar grammar = MarkGrammar::kPlace);

 private:
  struct Engine;
  MarkReader();
  enum class Signs { kLetters, kDigits, kShort, kShortInAMirror };
  std::optional<ReadMark> read_place(const cv::Mat& line, double px_per_mm, bool mirrored);
  std::optional<ReadMark> read_short(const cv::Mat& line, double px_per_mm, bool mirrored);
  Reading read_part(Signs signs, const cv::Mat& line, const cv::Rect& part, double px_per_mm, std::size_t length);
  std::unique_ptr<Engine> engine_;
};

}  // namespace veneer::proof
