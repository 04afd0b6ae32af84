#include "planner/plan.h"

#include <algorithm>

namespace veneer::planner {

ArtworkSize artwork_size(const cv::Mat& picture, Millimetres shorter) {
  const double aspect = static_cast<double>(picture.cols) / picture.rows;
  if (aspect >= 1) return {shorter * aspect, shorter};
  return {shorter, shorter / aspect};
}

std::string artwork_letter(std::size_t index) {
  std::string letters;
  for (std::size_t rest = index + 1; rest > 0; rest = (rest - 1) / 26)
    letters.insert(letters.begin(), static_cast<char>('A' + (rest - 1) % 26));
  return letters;
}

double cost_total(const Plan& plan) {
  double sum = 0;
  for (const Piece& piece : plan.pieces) sum += piece.cost;
  return sum;
}

double cost_per_pixel(const Plan& plan) {
  std::int64_t pixels = 0;
  for (const Piece& piece : plan.pieces)
    if (piece.placement) pixels += piece.pixels;
  return pixels == 0 ? 0 : cost_total(plan) / static_cast<double>(pixels);
}

std::size_t unfilled(const Plan& plan) {
  return static_cast<std::size_t>(
      std::count_if(plan.pieces.begin(), plan.pieces.end(), [](const Piece& piece) { return !piece.placement; }));
}

}  // namespace veneer::planner
