#include "drivers/sim/proof/mark_reader.h"

#include <tesseract/baseapi.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

namespace veneer::proof {
namespace {

constexpr double kInkBelow = 0.65;     // of the back's own grey
constexpr double kLeastBar = 1.2;      // mm
constexpr double kBarThickness = 0.5;  // mm
constexpr double kSpeck = 0.02;        // mm2, smaller ink is dirt
constexpr double kSure = 80;
constexpr double kClearly = 20;
constexpr double kShortSure = 40;  // of the surest of two readings that agree; in a mirror kSure
constexpr std::size_t kMostShortSigns = 4;
// Of short marks: all signs, and those that are the same in a mirror. They are looked for among all capitals and
// digits: told of a few only, Tesseract finds these in anything, and in a mirror image too.
constexpr const char* kShortSigns = "12345678ACDEFHKLMNPRUVWXY";
constexpr const char* kSameInAMirror = "8AHMUVWXY";
// And those that are read as themselves in a mirror between two of these: a mark of three or more that is the same
// backwards is not believed with them.
constexpr const char* kNearlySameInAMirror = "48AHMNUVWXY";

// Heights of a capital in pixels, and how wide its strokes are made, as a part of that height: tesseract is trained on
// print, whose strokes are heavier than a laser's line in a large mark. Those of a small mark are heavy enough.
struct Rendering {
  int capital_px;
  double weight;
};
constexpr Rendering kRenderings[] = {{28, 0.15}, {32, 0.135}, {30, 0.17},  {36, 0.15}, {26, 0.135},
                                     {34, 0.18}, {30, 0.115}, {40, 0.115}, {36, 0}};

double stroke_width_px(const cv::Mat& line) {
  cv::Mat ink = line > 127, depth;
  cv::copyMakeBorder(ink, ink, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(ink, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  std::vector<float> middle;  // along the strokes' middles, where no neighbour lies deeper
  cv::Mat deepest;
  cv::dilate(depth, deepest, cv::Mat());
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      if (const float d = depth.at<float>(y, x); d > 0 && d >= deepest.at<float>(y, x)) middle.push_back(d);
  if (middle.empty()) return 0;
  const auto half = middle.begin() + static_cast<std::ptrdiff_t>(middle.size() / 2);
  std::nth_element(middle.begin(), half, middle.end());
  return 2.0 * *half;
}

bool may_be_the_same_in_a_mirror(const std::string& mark) {
  if (mark.find_first_not_of(kSameInAMirror) == std::string::npos) return true;
  return mark.size() > 2 && mark.find_first_not_of(kNearlySameInAMirror) == std::string::npos &&
         std::equal(mark.begin(), mark.end(), mark.rbegin());
}

struct Character {
  cv::Rect box;
  bool hyphen = false;
};

double median_of_wood(const cv::Mat& grey) {
  int histogram[256] = {};
  int count = 0;
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      if (const int v = grey.at<unsigned char>(y, x); v < 255) {
        ++histogram[v];
        ++count;
      }
  int seen = 0;
  for (int v = 0; v < 255; ++v) {
    seen += histogram[v];
    if (2 * seen >= count) return v;
  }
  return 255;
}

struct Bar {
  cv::Point2d centre;
  cv::Point2d along;  // unit
  int label = 0;
};

// From one side of it to the other, wherever it is thickest: an I is no bar, for its feet.
double thickness_of(const Bar& bar, const cv::Mat& labels, const cv::Rect& box) {
  double low = 0, high = 0;
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x) {
      if (labels.at<int>(y, x) != bar.label) continue;
      const double aside = (cv::Point2d(x, y) - bar.centre).cross(bar.along);
      low = std::min(low, aside), high = std::max(high, aside);
    }
  return high - low;
}

std::optional<Bar> find_bar(const cv::Mat& labels, const cv::Mat& stats, int count, double px_per_mm) {
  std::optional<Bar> best;
  double longest = kLeastBar * px_per_mm;
  for (int label = 1; label < count; ++label) {
    const int* s = stats.ptr<int>(label);
    const cv::Rect box(s[0], s[1], s[2], s[3]);
    if (std::hypot(box.width, box.height) < longest) continue;
    const cv::Moments m = cv::moments(labels(box) == label, true);
    const double angle = 0.5 * std::atan2(2 * m.mu11, m.mu20 - m.mu02);
    const double spread = std::hypot(m.mu20 - m.mu02, 2 * m.mu11);
    // Of a filled bar the variance along it is length^2 / 12.
    const double length = std::sqrt(6 * (m.mu20 + m.mu02 + spread) / m.m00);
    if (length < longest) continue;
    const Bar bar{{box.x + m.m10 / m.m00, box.y + m.m01 / m.m00}, {std::cos(angle), std::sin(angle)}, label};
    if (thickness_of(bar, labels, box) > kBarThickness * px_per_mm) continue;
    longest = length;
    best = bar;
  }
  return best;
}

// The text's box, along the bar and away from it.
struct TextBox {
  cv::Point2d right, up;  // unit, in the picture (y down)
  cv::Point2d corner;     // upper left
  cv::Size size;
};

std::optional<TextBox> find_text(const cv::Mat& labels, const cv::Mat& stats, const Bar& bar, double px_per_mm) {
  TextBox box;
  box.right = bar.along;
  box.up = {bar.along.y, -bar.along.x};
  double low_u = 1e9;
  double high_u = -1e9;
  double low_v = 1e9;
  double high_v = -1e9;
  double sum = 0;
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x) {
      const int label = labels.at<int>(y, x);
      if (label == 0 || label == bar.label) continue;
      if (stats.at<int>(label, cv::CC_STAT_AREA) < kSpeck * px_per_mm * px_per_mm) continue;
      const cv::Point2d p = cv::Point2d(x, y) - bar.centre;
      const double u = p.dot(box.right);
      const double v = p.dot(box.up);
      low_u = std::min(low_u, u);
      high_u = std::max(high_u, u);
      low_v = std::min(low_v, v);
      high_v = std::max(high_v, v);
      sum += v;
    }
  if (low_u > high_u) return std::nullopt;
  if (sum < 0) {  // the ink lies on the other side: look at it from there
    box.right = -box.right;
    box.up = -box.up;
    low_u = -std::exchange(high_u, -low_u);
    low_v = -std::exchange(high_v, -low_v);
  }
  box.size = {static_cast<int>(high_u - low_u) + 3, static_cast<int>(high_v - low_v) + 3};
  box.corner = bar.centre + box.right * (low_u - 1) + box.up * (high_v + 1);
  const bool plausible = box.size.height > 0.8 * px_per_mm && box.size.height < 8 * px_per_mm;
  return plausible && box.size.width < 40 * px_per_mm ? std::optional(box) : std::nullopt;
}

std::vector<Character> characters_of(const cv::Mat& line, double px_per_mm) {
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(line > 127, labels, stats, centroids, 8, CV_32S);
  std::vector<cv::Rect> boxes;
  int tallest = 0;
  for (int label = 1; label < count; ++label) {
    const int* s = stats.ptr<int>(label);
    if (s[cv::CC_STAT_AREA] < kSpeck * px_per_mm * px_per_mm) continue;
    boxes.emplace_back(s[0], s[1], s[2], s[3]);
    tallest = std::max(tallest, s[3]);
  }
  std::sort(boxes.begin(), boxes.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
  std::vector<Character> out;
  for (const cv::Rect& box : boxes) {
    if (!out.empty()) {
      cv::Rect& last = out.back().box;
      const int shared = std::min(last.br().x, box.br().x) - box.x;
      if (shared > 0.5 * std::min(last.width, box.width)) {  // one character in two strokes
        last |= box;
        continue;
      }
    }
    out.push_back({box, false});
  }
  for (Character& c : out) c.hyphen = c.box.height < 0.35 * tallest && c.box.width > c.box.height;
  return out;
}

cv::Rect join(const std::vector<Character>& characters, std::size_t first, std::size_t last) {
  cv::Rect box = characters[first].box;
  for (std::size_t i = first; i < last; ++i) box |= characters[i].box;
  return box;
}

cv::Mat without_empty_columns(const cv::Mat& ink) {
  cv::Mat points;
  cv::findNonZero(ink > 127, points);
  const cv::Rect box = points.empty() ? cv::Rect(0, 0, ink.cols, ink.rows) : cv::boundingRect(points);
  return ink(cv::Rect(box.x, 0, box.width, ink.rows));
}

// Two lines of text as one, the upper one first: where rows without ink part the text near its middle. One line is left
// as it is: its characters are as high as itself.
cv::Mat as_one_line(const cv::Mat& text) {
  cv::Mat most;
  cv::reduce(text, most, 1, cv::REDUCE_MAX);
  int above = -1, below = -1;  // the last row of the upper line, the first one of the lower line
  for (int y = text.rows / 4; y < text.rows - text.rows / 4; ++y) {
    if (most.at<unsigned char>(y) > 127) continue;
    if (above < 0) above = y - 1;
    below = y + 1;
  }
  if (above < 0) return text;
  const cv::Mat upper = without_empty_columns(text.rowRange(0, above + 1));
  const cv::Mat lower = without_empty_columns(text.rowRange(below, text.rows));
  const int height = std::max(upper.rows, lower.rows), gap = height / 4;
  cv::Mat line(height, upper.cols + gap + lower.cols, text.type(), cv::Scalar(0));
  upper.copyTo(line(cv::Rect(0, height - upper.rows, upper.cols, upper.rows)));
  lower.copyTo(line(cv::Rect(upper.cols + gap, height - lower.rows, lower.cols, lower.rows)));
  return line;
}

}  // namespace

std::optional<Reading> most_often(std::span<const Reading> readings) {
  const auto most = std::ranges::max_element(readings, {}, &Reading::times);
  if (most == readings.end() || std::ranges::count(readings, most->times, &Reading::times) > 1) return std::nullopt;
  return *most;
}

struct MarkReader::Engine {
  tesseract::TessBaseAPI letters;
  tesseract::TessBaseAPI digits;
  tesseract::TessBaseAPI short_signs;
};

MarkReader::MarkReader() : engine_(std::make_unique<Engine>()) {}
MarkReader::~MarkReader() = default;

Result<std::unique_ptr<MarkReader>> MarkReader::create() {
  std::unique_ptr<MarkReader> reader(new MarkReader());
  for (tesseract::TessBaseAPI* api :
       {&reader->engine_->letters, &reader->engine_->digits, &reader->engine_->short_signs}) {
    if (api->Init(nullptr, "eng", tesseract::OEM_LSTM_ONLY) != 0)
      return Error{ErrorCode::kUnavailable, "tesseract has no English data: install tesseract-ocr-eng"};
    api->SetPageSegMode(tesseract::PSM_SINGLE_LINE);
    api->SetVariable("load_system_dawg", "0");
    api->SetVariable("load_freq_dawg", "0");
  }
  reader->engine_->letters.SetVariable("tessedit_char_whitelist", "ABCDEFGHIJKLMNOPQRSTUVWXYZ");
  reader->engine_->digits.SetVariable("tessedit_char_whitelist", "0123456789-");
  reader->engine_->short_signs.SetVariable("tessedit_char_whitelist", "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ");
  return reader;
}

Reading MarkReader::read_part(Signs signs, const cv::Mat& line, const cv::Rect& part, double px_per_mm,
                              std::size_t length) {
  tesseract::TessBaseAPI& api = signs == Signs::kLetters  ? engine_->letters
                                : signs == Signs::kDigits ? engine_->digits
                                                          : engine_->short_signs;
  const int pad = static_cast<int>(std::lround(0.35 * px_per_mm));
  cv::Mat cut(part.height + 2 * pad, part.width + 2 * pad, CV_8UC1, cv::Scalar(0));
  line(part).copyTo(cut(cv::Rect(pad, pad, part.width, part.height)));
  const double drawn = stroke_width_px(line);
  const bool is_short = signs == Signs::kShort || signs == Signs::kShortInAMirror;
  std::vector<Reading> readings;
  Reading best;
  for (const Rendering& rendering : kRenderings) {
    const int radius = std::max(0, static_cast<int>(std::lround((rendering.weight * line.rows - drawn) / 2)));
    cv::Mat heavy;
    cv::dilate(cut, heavy, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}));
    const double scale = static_cast<double>(rendering.capital_px) / line.rows;
    cv::Mat small;
    cv::resize(255 - heavy, small, {}, scale, scale, cv::INTER_AREA);
    cv::copyMakeBorder(small, small, 8, 8, 8, 8, cv::BORDER_CONSTANT, cv::Scalar(255));
    api.SetImage(small.data, small.cols, small.rows, 1, static_cast<int>(small.step));
    api.SetSourceResolution(300);
    const std::unique_ptr<char[]> raw(api.GetUTF8Text());
    std::string text;
    for (const char* c = raw ? raw.get() : ""; *c != 0; ++c)
      if (std::isspace(static_cast<unsigned char>(*c)) == 0) text += *c;
    if (signs == Signs::kShort) {  // which has neither S nor T; a mirror makes them of other signs too
      std::ranges::replace(text, 'S', '5');
      std::ranges::replace(text, 'T', '7');
    }
    if (text.size() != length) continue;
    const double confidence = api.MeanTextConf();
    auto known = std::ranges::find(readings, text, &Reading::text);
    if (known == readings.end()) known = readings.insert(known, {text, 0, 0});
    Reading& reading = *known;
    reading.confidence = std::max(reading.confidence, confidence), ++reading.times;
    if (reading.times > 1 && (!is_short || reading.confidence >= kSure)) return reading;
    if (confidence / 2 > best.confidence || best.text.empty()) best = {text, confidence / 2, 1};
  }
  return is_short ? most_often(readings).value_or(Reading{}) : best;
}

std::optional<ReadMark> MarkReader::read_place(const cv::Mat& line, double px_per_mm, bool mirrored) {
  const std::vector<Character> characters = characters_of(line, px_per_mm);
  std::size_t hyphen = characters.size();
  for (std::size_t i = 0; i < characters.size(); ++i) {
    if (!characters[i].hyphen) continue;
    if (hyphen != characters.size()) return std::nullopt;
    hyphen = i;
  }
  const bool parted = hyphen < characters.size();
  if (hyphen < 2 || hyphen + 1 == characters.size()) return std::nullopt;
  std::optional<ReadMark> best;
  for (std::size_t letters = 1; letters <= std::min<std::size_t>(2, hyphen - 1); ++letters) {
    const Reading letter = read_part(Signs::kLetters, line, join(characters, 0, letters), px_per_mm, letters);
    const Reading number = read_part(Signs::kDigits, line, join(characters, letters, characters.size()), px_per_mm,
                                     characters.size() - letters);
    if (letter.text.empty() || number.text.empty() || (parted && number.text[hyphen - letters] != '-')) continue;
    if (std::count(number.text.begin(), number.text.end(), '-') != (parted ? 1 : 0)) continue;
    if (number.text[0] == '0' && hyphen - letters > 1) continue;  // an O, not a leading zero
    const double confidence = std::min(letter.confidence, number.confidence);
    // An S after the letter is a 5 more often.
    if (!best || confidence > best->confidence + kClearly)
      best = ReadMark{letter.text + number.text, mirrored, {}, confidence};
    if (confidence >= kSure) break;
  }
  return best;
}

std::optional<ReadMark> MarkReader::read_short(const cv::Mat& line, double px_per_mm, bool mirrored) {
  const std::vector<Character> characters = characters_of(line, px_per_mm);
  if (characters.empty() || characters.size() > kMostShortSigns) return std::nullopt;
  if (std::any_of(characters.begin(), characters.end(), [](const Character& c) { return c.hyphen; }))
    return std::nullopt;
  const Reading text = read_part(mirrored ? Signs::kShortInAMirror : Signs::kShort, line,
                                 join(characters, 0, characters.size()), px_per_mm, characters.size());
  if (text.times < 2 || text.confidence < (mirrored ? kSure : kShortSure)) return std::nullopt;
  if (text.text.find_first_not_of(kShortSigns) != std::string::npos) return std::nullopt;
  if (may_be_the_same_in_a_mirror(text.text)) return std::nullopt;
  return ReadMark{text.text, mirrored, {}, text.confidence};
}

std::optional<ReadMark> MarkReader::read(const cv::Mat& back, double px_per_mm, MarkGrammar grammar) {
  const cv::Mat ink = back < kInkBelow * median_of_wood(back);
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(ink, labels, stats, centroids, 8, CV_32S);
  const std::optional<Bar> bar = find_bar(labels, stats, count, px_per_mm);
  if (!bar) return std::nullopt;
  const std::optional<TextBox> box = find_text(labels, stats, *bar, px_per_mm);
  if (!box) return std::nullopt;

  cv::Mat text = ink.clone();
  text.setTo(0, labels == bar->label);
  const cv::Point2d& right = box->right;
  const cv::Point2d& up = box->up;
  const cv::Matx23d picture_from_line(right.x, -up.x, box->corner.x, right.y, -up.y, box->corner.y);
  cv::Mat line;
  cv::warpAffine(text, line, picture_from_line, box->size, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_CONSTANT,
                 cv::Scalar(0));
  const auto read_line = [&](bool mirrored) {
    const cv::Mat one = as_one_line(line);
    return grammar == MarkGrammar::kShort ? read_short(one, px_per_mm, mirrored) : read_place(one, px_per_mm, mirrored);
  };
  std::optional<ReadMark> mark = read_line(false);
  // Many short marks read as others in a mirror, and surely: they are looked at there only when nothing else is left.
  if (!mark || (grammar == MarkGrammar::kPlace && mark->confidence < kSure)) {
    cv::flip(line, line, 1);
    const std::optional<ReadMark> turned = read_line(true);
    if (turned && (!mark || turned->confidence > mark->confidence)) mark = turned;
  }
  if (mark) mark->up = {up.x, -up.y};
  return mark;
}

}  // namespace veneer::proof
