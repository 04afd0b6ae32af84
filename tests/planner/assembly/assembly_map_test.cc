// The map, opened again by programs that are not ours: Ghostscript reads the PDF, pugixml the SVG.
#include "planner/assembly/assembly_map.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <pugixml.hpp>
#include <sstream>

#include "planner/assembly/map_squares.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kRows = 3, kColumns = 5;
constexpr double kSide = 14;

// Pieces of one grid, the right half from another panel, the last one without wood.
Plan grid_plan() {
  Plan plan;
  plan.artworks = {{"face.png", "A", Millimetres(kColumns * kSide), Millimetres(kRows * kSide)}};
  plan.panels = {{{"P-1"}, Millimetres(200), Millimetres(200), 300},
                 {{"P-2"}, Millimetres(200), Millimetres(200), 300}};
  plan.dpi = 300;
  plan.kerf = 0.15_mm;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      Piece piece;
      piece.mark = "A" + std::to_string(row + 1) + "-" + std::to_string(column + 1);
      piece.row = row, piece.column = column;
      const double x = column * kSide, y = (kRows - 1 - row) * kSide;
      piece.artwork_outline = {point<ArtworkFrame>(x, y), point<ArtworkFrame>(x + kSide, y),
                               point<ArtworkFrame>(x + kSide, y + kSide), point<ArtworkFrame>(x, y + kSide)};
      // Farther apart than the kerf, in the order of columns.
      piece.placement = Placement{{column < 3 ? "P-1" : "P-2"},
                                  {Radians(0), point<PanelFrame>(20 + 10 * column, 20 + 10 * (kRows - 1 - row))}};
      plan.pieces.push_back(std::move(piece));
    }
  plan.pieces.back().placement.reset();
  return plan;
}

// What Ghostscript finds on each page: a word and where it begins, in millimetres from the page's upper left corner.
struct Word {
  std::string text;
  double x = 0, y = 0;
};
using Page = std::vector<Word>;

class AssemblyMapTest : public ::testing::Test {
 protected:
  std::string drawn(const MapOptions& options, PageFormat format = PageFormat::kPdf) {
    const auto order = cutting_order(plan_);
    EXPECT_TRUE(order.ok());
    auto file = draw_assembly_map({plan_, {}, *order}, options, format);
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
    return file.ok() ? *file : "";
  }

  std::vector<std::string> texts_of_pages(const std::string& pdf) const {
    std::ofstream(folder_ / "map.pdf", std::ios::binary) << pdf;
    const std::string command = "gs -q -dBATCH -dNOPAUSE -dSAFER -sDEVICE=txtwrite -sOutputFile='" +
                                (folder_ / "page-%d.txt").string() + "' '" + (folder_ / "map.pdf").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe,cert-env33-c): one thread
    std::vector<std::string> pages;
    for (int i = 1;; ++i) {
      std::ifstream file(folder_ / ("page-" + std::to_string(i) + ".txt"));
      if (!file) return pages;
      std::ostringstream text;
      text << file.rdbuf();
      pages.push_back(text.str());
      std::filesystem::remove(folder_ / ("page-" + std::to_string(i) + ".txt"));  // the next document's are its own
    }
  }

  // Words with their places, as txtwrite tells them in XML: <span bbox="x0 y0 x1 y1" ...><char bbox=... c="A"/>
  std::vector<Page> words_of_pages(const std::string& pdf) const {
    std::ofstream(folder_ / "map.pdf", std::ios::binary) << pdf;
    const std::string command = "gs -q -dBATCH -dNOPAUSE -dSAFER -sDEVICE=txtwrite -dTextFormat=0 -sOutputFile='" +
                                (folder_ / "page-%d.xml").string() + "' '" + (folder_ / "map.pdf").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe,cert-env33-c): one thread
    std::vector<Page> pages;
    for (int i = 1;; ++i) {
      std::ifstream file(folder_ / ("page-" + std::to_string(i) + ".xml"));
      if (!file) return pages;
      std::ostringstream text;
      text << "<root>" << file.rdbuf() << "</root>";
      pugi::xml_document document;
      EXPECT_TRUE(document.load_string(text.str().c_str()));
      Page& page = pages.emplace_back();
      for (const auto& found : document.select_nodes("//span")) {
        Word word;
        double right = 0, bottom = 0;
        EXPECT_GE(
            std::sscanf(found.node().attribute("bbox").value(), "%lf %lf %lf %lf", &word.x, &word.y, &right, &bottom),
            2);
        for (const auto c : found.node().children("char")) word.text += c.attribute("c").value();
        word.x = (word.x + right) / 2, word.y = (word.y + bottom) / 2;
        page.push_back(word);
      }
    }
  }

  Plan plan_ = grid_plan();
  testing::TempDirectory folder_;
};

TEST_F(AssemblyMapTest, HasAnOverviewTheMapAndBothLists) {
  const auto pages = texts_of_pages(drawn({}));
  ASSERT_EQ(pages.size(), 4U);
  EXPECT_THAT(pages[0], HasSubstr("face.png: back view"));
  EXPECT_THAT(pages[0], HasSubstr("15 pieces"));
  EXPECT_THAT(pages[0], HasSubstr("P-1: 9 pieces"));
  EXPECT_THAT(pages[0], HasSubstr("P-2: 5 pieces"));
  EXPECT_THAT(pages[0], HasSubstr("no wood yet: 1 pieces"));
  for (const Piece& piece : plan_.pieces) {
    EXPECT_THAT(pages[1], HasSubstr(piece.mark)) << "on the map";
    EXPECT_THAT(pages[2], HasSubstr(piece.mark)) << "by place";
    if (piece.placement) {
      EXPECT_THAT(pages[3], HasSubstr(piece.mark)) << "by cutting";
    }
  }
  EXPECT_THAT(pages[3], HasSubstr("Panel P-1"));
  EXPECT_THAT(pages[3], Not(HasSubstr("A3-5"))) << "without wood nothing is cut";
}

// In the back view the picture's right is at the left; in the show view it is where it is.
TEST_F(AssemblyMapTest, MarksLieWhereTheirPiecesDoInEitherView) {
  for (const MapView view : {MapView::kBack, MapView::kShow}) {
    const auto pages = words_of_pages(drawn({view}));
    ASSERT_GE(pages.size(), 2U);
    std::map<std::string, Word> at;
    for (const Word& word : pages[1]) at[word.text] = word;
    for (const char* mark : {"A1-1", "A1-5", "A3-1"}) ASSERT_EQ(at.count(mark), 1U) << mark;
    EXPECT_EQ(at["A1-5"].x < at["A1-1"].x, view == MapView::kBack);
    EXPECT_LT(at["A1-1"].y, at["A3-1"].y);
    EXPECT_NEAR(at["A1-1"].x, at["A3-1"].x, 1) << "one column";
  }
}

TEST_F(AssemblyMapTest, TrueSizeComesInTilesThatCoverTheArtworkAndNoMore) {
  plan_.artworks[0].width = Millimetres(kColumns * kSide * 5);
  plan_.artworks[0].height = Millimetres(kRows * kSide * 9);
  for (Piece& piece : plan_.pieces) {
    for (auto& p : piece.artwork_outline) p = {p.x * 5.0, p.y * 9.0};
    piece.placement.reset();
  }
  MapOptions options;
  options.scale = MapScale::kTrue;
  const auto file = draw_assembly_map({plan_, {}, {}}, options, PageFormat::kPdf);
  ASSERT_TRUE(file.ok());
  // 350 x 378 mm: two tiles across and two down on A4, whichever way it lies.
  const auto pages = texts_of_pages(*file);
  ASSERT_EQ(pages.size(), 1 + 4 + 1U) << "an overview, tiles, a list by place: nothing is cut";
  EXPECT_THAT(pages[1], HasSubstr("tile 1"));
  EXPECT_THAT(pages[4], HasSubstr("tile 4"));
  EXPECT_THAT(pages[1], HasSubstr("100 mm. Printed true when this bar measures it"));
  options.paper = kA3;
  const auto large = draw_assembly_map({plan_, {}, {}}, options, PageFormat::kPdf);
  EXPECT_EQ(texts_of_pages(*large).size(), 1 + 2 + 1U);
}

TEST_F(AssemblyMapTest, AnSvgOfTrueSizeIsAsLargeAsTheArtworkAndItsFrame) {
  MapOptions options;
  options.scale = MapScale::kTrue;
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(drawn(options, PageFormat::kSvg).c_str()));
  const double width = std::atof(document.child("svg").attribute("width").value()) * 25.4 / 72;
  EXPECT_GT(width, kColumns * kSide);
  EXPECT_LT(width, kColumns * kSide + 40);
}

TEST_F(AssemblyMapTest, CurvesStayCurves) {
  const std::string straight = drawn({}, PageFormat::kSvg);
  Partition layout;
  layout.width = plan_.artworks[0].width, layout.height = plan_.artworks[0].height;
  for (const Piece& piece : plan_.pieces) {
    const auto& ring = piece.artwork_outline;
    PartitionFace& face = layout.faces.emplace_back();
    for (std::size_t i = 0; i < ring.size(); ++i) {
      face.boundary.push_back({layout.edges.size(), false});
      const auto &a = ring[i], &b = ring[(i + 1) % ring.size()];
      PartitionEdge edge = straight_edge(a, b);
      edge.curve[1].x += 1_mm;
      layout.edges.push_back(std::move(edge));
    }
  }
  plan_.layouts = {layout};
  const auto paths_with_curves = [](const std::string& svg) {
    pugi::xml_document document;
    EXPECT_TRUE(document.load_string(svg.c_str()));
    int count = 0;
    // Filled pieces; letters are symbols of their own.
    for (const auto& path : document.select_nodes("/svg/g//path"))
      count += std::string(path.node().attribute("d").value()).find('C') != std::string::npos ? 1 : 0;
    return count;
  };
  EXPECT_GE(paths_with_curves(drawn({}, PageFormat::kSvg)) - paths_with_curves(straight), kRows * kColumns);
}

TEST_F(AssemblyMapTest, TheOrderOfCuttingIsThatOfTheCutFiles) {
  const auto order = cutting_order(plan_);
  ASSERT_TRUE(order.ok());
  ASSERT_EQ(order->size(), 2U);
  EXPECT_EQ((*order)[0].title, "Panel P-1");
  EXPECT_EQ((*order)[0].pieces.size(), 9U);
  EXPECT_EQ((*order)[1].pieces.size(), 5U);
}

TEST_F(AssemblyMapTest, APictureThatThePlanDoesNotHaveIsRefused) {
  MapOptions options;
  options.artwork = 1;
  const auto refused = draw_assembly_map({plan_, {}, {}}, options, PageFormat::kPdf);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

TEST(MapSquares, AreNamedFromTheUpperLeftCorner) {
  const auto squares = MapSquares::over(Millimetres(200), Millimetres(100));
  EXPECT_EQ(squares.across, 8);
  EXPECT_EQ(squares.down, 4);
  EXPECT_EQ(squares.square_of(point<MapFrame>(1, 99)), "a1");
  EXPECT_EQ(squares.square_of(point<MapFrame>(199, 1)), "h4");
  EXPECT_EQ(squares.square_of(point<MapFrame>(200, 0)), "h4") << "the far border too";
}

}  // namespace
}  // namespace veneer::planner
