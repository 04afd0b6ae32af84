#include "planner/suggest/contact_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/pictures/resample.h"
#include "planner/plan_options.h"

namespace veneer::planner {
namespace {

constexpr int kPicture = 300, kSheetGap = 18, kTextLine = 19, kTextLines = 4;
const cv::Scalar kPaper(250, 250, 248), kInk(40, 40, 40), kPale(120, 120, 120), kFrame(60, 140, 30);

cv::Mat fitted_within(const cv::Mat& picture, int side) {
  const double scale = static_cast<double>(side) / std::max(picture.cols, picture.rows);
  return stretch(picture, std::max(1, cvRound(picture.cols * scale)), std::max(1, cvRound(picture.rows * scale)));
}

void write_on(cv::Mat& sheet, const std::string& text, cv::Point at, const cv::Scalar& colour, double size = 0.45) {
  cv::putText(sheet, text, at, cv::FONT_HERSHEY_SIMPLEX, size, colour, 1, cv::LINE_AA);
}

std::vector<std::string> lines_of(const Suggestion& it, std::size_t number, bool is_best) {
  return {fmt::format("{}: {:.0f} x {:.0f} mm{}", number, it.width.count(), it.height.count(),
                      is_best ? " - suggested" : ""),
          fmt::format("{} pieces of {:.1f} mm, {}", it.pieces, it.patch.count(), layout_text(it.layout)),
          fmt::format("about {} to cut", duration_text(it.cutting)),
          it.unfilled > 0 ? fmt::format("wood is missing for {}", it.unfilled)
                          : fmt::format("likeness {:.2f}, cost {:.4f}", it.likeness, it.cost_per_pixel)};
}

}  // namespace

std::string duration_text(std::chrono::duration<double> duration) {
  const auto minutes = std::max(1L, std::lround(duration.count() / 60));
  return minutes < 60 ? fmt::format("{} min", minutes) : fmt::format("{} h {} min", minutes / 60, minutes % 60);
}

std::string layout_text(LayoutKind layout) {
  PlanOptions options;
  options.layout = layout;
  return option_text(options, "layout");
}

cv::Mat contact_sheet(const Advice& advice, const cv::Mat& picture) {
  std::vector<std::vector<std::size_t>> rows;
  for (std::size_t i = 0; i < advice.suggestions.size(); ++i) {
    if (i == 0 || advice.suggestions[i].crop != advice.suggestions[i - 1].crop) rows.emplace_back();
    rows.back().push_back(i);
  }
  std::size_t columns = 0;
  for (const auto& row : rows) columns = std::max(columns, row.size());
  const double tallest = static_cast<double>(picture.rows) / std::max(picture.cols, picture.rows),
               widest = static_cast<double>(picture.cols) / std::max(picture.cols, picture.rows);
  const int cell_width = std::max(cvRound(kPicture * widest), 250) + kSheetGap,
            cell_height = cvRound(kPicture * tallest) + kTextLines * kTextLine + 2 * kSheetGap;
  cv::Mat sheet(std::max(1, cell_height * static_cast<int>(rows.size()) + kSheetGap),
                cell_width * (1 + static_cast<int>(columns)) + kSheetGap, CV_8UC3, kPaper);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const cv::Point corner(kSheetGap, kSheetGap + static_cast<int>(r) * cell_height);
    const cv::Rect& crop = advice.suggestions[rows[r].front()].crop;
    const cv::Mat part = fitted_within(picture(crop), kPicture);
    part.copyTo(sheet(cv::Rect(corner, part.size())));
    write_on(sheet,
             r == 0   ? "the whole picture"
             : r == 1 ? "closer"
                      : "closest",
             corner + cv::Point(0, part.rows + kTextLine), kPale);
    for (std::size_t k = 0; k < rows[r].size(); ++k) {
      const std::size_t i = rows[r][k];
      const Suggestion& it = advice.suggestions[i];
      const cv::Mat shown = fitted_within(it.preview, kPicture);
      const cv::Rect place(corner + cv::Point(static_cast<int>(k + 1) * cell_width, 0), shown.size());
      shown.copyTo(sheet(place));
      const bool is_best = advice.best == i;
      if (is_best)
        cv::rectangle(sheet, cv::Rect(place.x - 5, place.y - 5, place.width + 10, place.height + 10), kFrame, 4);
      int baseline = place.br().y;
      for (const std::string& text : lines_of(it, i + 1, is_best)) {
        baseline += kTextLine;
        write_on(sheet, text, {place.x, baseline}, is_best && baseline == place.br().y + kTextLine ? kFrame : kInk);
      }
    }
  }
  return sheet;
}

}  // namespace veneer::planner
