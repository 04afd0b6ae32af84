// How large jobs may be, so that the wood of a life (cell_life.cc) lasts for all of them. Reckoned in places for one
// piece and not in area: most of what is free in the end lies in strips that no piece fits into.
#pragma once

namespace veneer::soak {

class WoodPlaces {
 public:
  // For squares of 10 mm on a panel of 200 x 140 mm, as counted on one that was used up. Others have less, so a tenth
  // is left for what is done after the last job.
  static constexpr int kOfAPanel = 35;

  explicit WoodPlaces(int panels) : all_(kOfAPanel * panels), left_(all_) {}

  void take(int pieces) { left_ -= pieces; }
  void give_back(int pieces) { left_ += pieces; }
  int left() const { return left_; }

  // Of the next job, in pieces along a side, when it and so many more are wanted; `chance` is from 0 to 1.
  int across(int jobs_left, double chance) const {
    const double pieces = (left_ - all_ / 10.0) / jobs_left;
    if (pieces < 4) return chance < (pieces - 1) / 3 ? 2 : 1;
    return chance < (pieces - 4) / 5 ? 3 : 2;
  }

 private:
  int all_, left_;
};

}  // namespace veneer::soak
