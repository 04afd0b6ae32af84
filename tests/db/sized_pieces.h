// How much of the database pieces take from their plans to their last state.
#pragma once

#include <cmath>
#include <filesystem>

#include "tests/db/cell_database.h"

namespace veneer::db {

inline constexpr int kSizedColumns = 20, kSizedRows = 13;

// A square, or a piece whose border waves: with 70 corners as long as those of the demo's first portrait are on average
// (523 curved pieces with leads).
inline PlannedPatch sized_piece(const PanelId& panel, int column, int row, int corners) {
  PlannedPatch piece;
  piece.mark = fmt::format("A{}-{}", row + 1, column + 1);
  piece.panel = panel;
  constexpr double kPitch = 17, kKerf = 0.3;
  const double x = 20 + kPitch * column, y = 20 + kPitch * row;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * kPi * (i + 0.5) / corners + 0.1 * column;
    const double radius = corners == 4 ? 7 : 6.4 + 0.5 * std::sin(3 * angle + row);
    piece.artwork_outline.push_back(point<ArtworkFrame>(radius * std::cos(angle), radius * std::sin(angle)));
  }
  piece.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0.37 * row), point<PanelFrame>(x, y));
  piece.panel_outline = piece.panel_from_artwork * piece.artwork_outline;
  const Point<PanelFrame> corner = piece.panel_outline.front();
  const double outwards = std::atan2(corner.y.count() - y, corner.x.count() - x);
  const auto beside = [&](double along, double across) {
    return point<PanelFrame>(corner.x.count() + along * std::cos(outwards) - across * std::sin(outwards),
                             corner.y.count() + along * std::sin(outwards) + across * std::cos(outwards));
  };
  piece.lead_in = beside(1.1, 0);
  piece.allocation = unite(offset(Region<PanelFrame>(piece.panel_outline), Millimetres(kKerf)),
                           Region<PanelFrame>(Ring<PanelFrame>{beside(0, -0.15), beside(1.2, -0.15), beside(1.25, 0),
                                                               beside(1.2, 0.15), beside(0, 0.15)}));
  return piece;
}

// Of the schema alone, which is there once.
inline double size_of_empty() {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  static_cast<void>(must(Database::open(file)));
  return static_cast<double>(std::filesystem::file_size(file));
}

// Cut on so many panels, one job and run after the other; `book` books a piece that is being cut.
template <class Book>
double database_bytes_a_piece(int panels, int corners, const Book& book) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  {
    Database database = must(Database::open(file));
    JobStore jobs(database);
    for (int number = 1; number <= panels; ++number) {
      const PanelId panel{fmt::format("P-{:04d}", number)};
      if (!Panels(database).add(sheet(panel), {}, {}).ok()) std::abort();
      std::vector<PlannedPatch> pieces;
      for (int row = 0; row < kSizedRows; ++row)
        for (int column = 0; column < kSizedColumns; ++column)
          pieces.push_back(sized_piece(panel, column, row, corners));
      const JobId job = must(jobs.create(job_of(pieces), kNow));
      const RunId run = must(jobs.start_run(job, panel, {}, 0.05_mm, kNow));
      for (const PieceRecord& piece : must(jobs.pieces(job))) {
        VENEER_EXPECT_OK(jobs.mark_cutting(piece.id, kNow));
        VENEER_EXPECT_OK(book(jobs, piece, run));
      }
      VENEER_EXPECT_OK(jobs.finish_run(run, false, kLater));
    }
  }
  return (static_cast<double>(std::filesystem::file_size(file)) - size_of_empty()) /
         (panels * kSizedRows * kSizedColumns);
}

}  // namespace veneer::db
