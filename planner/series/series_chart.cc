// The curve of a series: cost against the number of pictures, as SVG.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planner/series/series.h"

namespace veneer::planner {
namespace {

constexpr double kWidth = 760, kHeight = 420, kLeft = 78, kRight = 190, kTop = 56, kBottom = 58;

// 1, 2 or 5 times a power of ten, so that four to eight steps reach `top`.
double step_for(double top) {
  const double power = std::pow(10, std::floor(std::log10(top / 4)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (top / (factor * power) <= 8) return factor * power;
  return 10 * power;
}

class Chart {
 public:
  Chart(std::size_t pictures, double highest) : pictures_(pictures) {
    step_ = step_for(highest);
    top_ = step_ * std::ceil(highest / step_);
  }

  double x(std::size_t pictures) const {
    const double share = pictures_ > 1 ? static_cast<double>(pictures - 1) / static_cast<double>(pictures_ - 1) : 0.5;
    return kLeft + share * (kWidth - kLeft - kRight);
  }
  double y(double cost) const { return kHeight - kBottom - cost / top_ * (kHeight - kTop - kBottom); }

  std::string axes() const {
    std::string out;
    for (int i = 0; i * step_ <= top_ * (1 + 1e-9); ++i) {
      const double at = y(i * step_);
      out += fmt::format("<path d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"#dddddd\"/>\n", kLeft, at, kWidth - kRight);
      out += label(kLeft - 8, at + 4, fmt::format("{:.6g}", i * step_), "end");
    }
    const std::size_t every = (pictures_ + 12) / 13;
    for (std::size_t k = 1; k <= pictures_; k += every)
      out += label(x(k), kHeight - kBottom + 20, std::to_string(k), "middle");
    out += label((kLeft + kWidth - kRight) / 2, kHeight - 14, "pictures from the same wood", "middle");
    out += label(18, 26, "Cost per pixel of the last picture; dashed: mean of all; hollow: incomplete", "start");
    return out;
  }

  std::string row(const std::vector<SeriesColumn>& columns, SeriesCost SeriesColumn::*of, const std::string& colour,
                  const std::string& name, double name_y) const {
    std::string last, mean, dots;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const SeriesCost& cost = columns[i].*of;
      const char* draw = i == 0 ? "M" : "L";
      mean += fmt::format("{}{:.1f} {:.1f}", draw, x(i + 1), y(cost.mean));
      if (!cost.last) continue;  // wood does not come back: nor does the line
      last += fmt::format("{}{:.1f} {:.1f}", draw, x(i + 1), y(*cost.last));
      dots +=
          fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\" stroke=\"{}\" stroke-width=\"2\"/>\n",
                      x(i + 1), y(*cost.last), cost.unfilled_last == 0 ? colour : "white", colour);
    }
    return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-dasharray=\"5 4\"/>\n", mean, colour) +
           fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", last, colour) + dots +
           label(kWidth - kRight + 14, name_y, name, "start", colour);
  }

 private:
  static std::string label(double x, double y, const std::string& text, const char* anchor,
                           const std::string& colour = "#333333") {
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\">{}</text>\n", x, y, anchor,
                       colour, text);
  }

  std::size_t pictures_;
  double step_ = 1, top_ = 1;
};

}  // namespace

std::string series_chart(const std::vector<SeriesColumn>& columns) {
  double highest = 1e-9;
  for (const SeriesColumn& column : columns)
    highest = std::max({highest, column.sequential.last.value_or(0), column.interleaved.last.value_or(0)});
  const Chart chart(std::max<std::size_t>(1, columns.size()), highest);
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" "
      "height=\"{1}\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"13\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      kWidth, kHeight);
  out += chart.axes();
  if (!columns.empty()) {
    // Names stand beside their lines' ends, but not on each other.
    double sequential = chart.y(columns.back().sequential.mean), interleaved = chart.y(columns.back().interleaved.mean);
    if (const double apart = interleaved - sequential; std::abs(apart) < 18) {
      const double push = (18 - std::abs(apart)) / 2 * (apart < 0 ? -1 : 1);
      sequential -= push, interleaved += push;
    }
    out += chart.row(columns, &SeriesColumn::sequential, "#b5651d", "picture after picture", sequential + 4);
    out += chart.row(columns, &SeriesColumn::interleaved, "#1f5fa8", "all together", interleaved + 4);
  }
  return out + "</svg>\n";
}

}  // namespace veneer::planner
