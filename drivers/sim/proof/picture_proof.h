// Comparing pictures: structural similarity, and block means of single pieces.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "drivers/sim/plane.h"

namespace veneer::proof {

// Pieces laid side by side, as they are seen from above.
struct Assembled {
  cv::Mat picture;  // BGR; the table shows where no wood lies
  cv::Mat cover;    // CV_8UC1, 0 to 255: the share of each pixel that is wood
};

// All of one size, covering width_mm x height_mm: grey, area-averaged to 75 dpi, the assembled picture under the best
// gain and offset, then the mean of SSIM with an 11 x 11 Gaussian window (sigma 1.5). Joints and char are part of the
// picture, as they are of the real one.
double picture_ssim(const cv::Mat& assembled, const cv::Mat& preview, double width_mm, double height_mm);

// The same of the wood alone: a pixel of 75 dpi that is wood for the greater part has the mean of its wood, without the
// `table` that shows through a joint. Pieces are cut with a clearance so that they fit; the joints that come of it,
// much narrower than such a pixel, are judged by the edges' errors. Wider gaps count as seen.
double picture_ssim_joints_filled(const Assembled& assembled, const cv::Scalar& table, const cv::Mat& preview,
                                  double width_mm, double height_mm);

// Mean colours of the blocks of 2 mm around a centre.
class BlockMeans {
 public:
  // Of a part of a picture: integrals of its colour (CV_64FC3, BGR), 0 outside, and of its mask, 0 or 1 (CV_64FC1),
  // each of one row and column more. Blocks lie symmetrically about `centre_px` and reach as far as half_px in x and y.
  // Those that leave the picture, or of which less than 60 % are set in the mask, are absent.
  BlockMeans(const cv::Mat& integral, const cv::Mat& mask_integral, sim::Vec2 centre_px, sim::Vec2 half_px,
             double px_per_mm);

  // Over blocks that both have, and `where` as well; nothing in common, or flat: correlation 0, difference infinite.
  struct Agreement {
    double in_colour = 0;    // correlation of the means of all three channels together
    double correlation = 0;  // of grey
    double difference = 0;   // root mean square of grey after each one's own mean is taken out
    double lightness = 0;    // grey levels between the two means
    int blocks = 0;          // that were compared
  };
  Agreement with(const BlockMeans& other, const BlockMeans& where) const;
  Agreement with(const BlockMeans& other) const { return with(other, other); }
  // The share of its own blocks that the other has too.
  double shared_with(const BlockMeans& other) const;
  BlockMeans mirrored() const;  // left and right exchanged

  // How it agrees with two places, its own and another, over the blocks that both have; nothing where the other has
  // fewer than 60 % of this one's blocks, or fewer than four can be compared with either. `seen`: the same piece
  // without what its own place does not show of it, which is what is held against that one.
  struct Rivals {
    Agreement own, other;
    // Correlates better, in colour and in grey. Of the few blocks of a small piece some other wood's correlate better
    // by chance, in grey: one to six pieces of a picture of 520 do. In colour a wood's hue tells it, but for a scanner
    // whose lamp has another one.
    bool other_is_nearer() const { return other.in_colour > own.in_colour && other.correlation > own.correlation; }
    // And by more than chance: of two correlations over n blocks, by Fisher's z = atanh(r), whose standard error is
    // 1 / sqrt(n - 3) (Fisher 1921), the other's lies above the own by that of their difference. Of pale, plain wood
    // five blocks that agree to 0.7 grey levels correlate by 0.97, and among five hundred previews some by more.
    bool other_is_nearer_than_by_chance() const;
  };
  std::optional<Rivals> rivals(const BlockMeans& other, const BlockMeans& own, const BlockMeans& seen) const;
  // For a place turned over, of the same wood: nothing unless, in grey, the correlation is higher and the difference
  // lower. Where it is of unlike shape, it has to come nearer by more than a scan's noise. One that is 20 grey levels
  // lighter or darker shows other wood, however the grain of a few blocks may run there.
  std::optional<Rivals> rather(const BlockMeans& other, const BlockMeans& own, const BlockMeans& seen) const;
  std::optional<Rivals> rather(const BlockMeans& other, const BlockMeans& own) const {
    return rather(other, own, *this);
  }

 private:
  struct Block {
    std::array<double, 3> colour{};  // BGR
    double grey = 0;                 // NaN where the block is absent
  };
  const Block& at(int column, int row) const;  // counted from the centre; negative ones lie left and above

  int columns_ = 0, rows_ = 0;  // each side of the centre
  std::vector<Block> blocks_;
};

}  // namespace veneer::proof
