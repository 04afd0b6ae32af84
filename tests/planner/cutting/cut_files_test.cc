// Cut files, each read by a program that is not ours: pugixml, dxflib, Ghostscript.
#include <dl_creationadapter.h>
#include <dl_dxf.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "planner/cutting/cut_drawing.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// What a reader found, in millimetres with +y up.
struct ReadStroke {
  std::string layer, piece;
  Polyline<BedFrame> path;
  bool closed = false;
};

struct Sheet {
  double width = 0, height = 0;
  std::map<std::string, std::string> colours;  // of each layer, as its format names it
  std::vector<ReadStroke> strokes;
};

Sheet sheet_of_svg(const std::string& text) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(text.c_str()));
  const pugi::xml_node root = document.child("svg");
  Sheet sheet;
  double box[4] = {};
  EXPECT_EQ(std::sscanf(root.attribute("viewBox").value(), "%lf %lf %lf %lf", box, box + 1, box + 2, box + 3), 4);
  sheet.width = std::atof(root.attribute("width").value()), sheet.height = std::atof(root.attribute("height").value());
  EXPECT_THAT(root.attribute("width").value(), HasSubstr("mm"));
  EXPECT_THAT(box, ElementsAre(0, 0, sheet.width, sheet.height));  // user units are millimetres
  for (const pugi::xml_node group : root.children("g")) {
    const std::string layer = group.attribute("id").value();
    sheet.colours[layer] = group.attribute("stroke").value();
    for (const pugi::xml_node path : group.children("path")) {
      ReadStroke stroke{layer, path.attribute("data-piece").value(), {}, false};
      std::istringstream data(path.attribute("d").value());
      for (std::string word; data >> word;) {
        double x = 0, y = 0;
        if (std::sscanf(word.c_str() + 1, "%lf,%lf", &x, &y) == 2)
          stroke.path.push_back(point<BedFrame>(x, sheet.height - y));
        stroke.closed = word == "Z";
      }
      sheet.strokes.push_back(std::move(stroke));
    }
  }
  return sheet;
}

struct DxfReader : DL_CreationAdapter {
  using DL_CreationAdapter::setVariableInt, DL_CreationAdapter::setVariableString;
  using DL_CreationAdapter::setVariableVector;
  void addLayer(const DL_LayerData& layer) override {
    sheet.colours[layer.name] = std::to_string(getAttributes().getColor());
  }
  void addXDataApp(const std::string& name) override { application = name; }
  void addXDataString(int, const std::string& value) override { piece = value; }
  void addPolyline(const DL_PolylineData& line) override {
    EXPECT_EQ(application, "VENEERD");
    sheet.strokes.push_back({getAttributes().getLayer(), piece, {}, (line.flags & 1) != 0});
    points.push_back(line.number);
  }
  void addVertex(const DL_VertexData& vertex) override {
    EXPECT_EQ(vertex.bulge, 0);
    sheet.strokes.back().path.push_back(point<BedFrame>(vertex.x, vertex.y));
  }
  void setVariableInt(const std::string& name, int value, int) override { numbers[name] = value; }
  void setVariableString(const std::string& name, const std::string& value, int) override { texts[name] = value; }
  void setVariableVector(const std::string& name, double x, double y, double, int) override {
    if (name == "$EXTMAX") sheet.width = x, sheet.height = y;
  }

  Sheet sheet;
  std::map<std::string, int> numbers;
  std::map<std::string, std::string> texts;
  std::vector<unsigned> points;
  std::string application, piece;
};

DxfReader read_dxf(const std::string& text) {
  DxfReader reader;
  std::stringstream stream(text);
  DL_Dxf dxf;
  EXPECT_TRUE(dxf.in(stream, &reader));
  EXPECT_EQ(reader.numbers["$INSUNITS"], 4);  // millimetres
  for (std::size_t i = 0; i < reader.sheet.strokes.size(); ++i)
    EXPECT_EQ(reader.sheet.strokes[i].path.size(), reader.points[i]);
  return reader;
}

// Ghostscript runs the file with a `stroke` that tells what it was to draw, in ten thousandths of a point.
constexpr const char* kTellingStroke = R"(
/number { 10000 mul round cvi =only ( ) print } def
/place { exch number number (\n) print } def
/stroke {
  currentrgbcolor exch 3 -1 roll (stroke ) print 3 { number } repeat currentlinewidth number (\n) print
  { (move ) print place } { (line ) print place } { (curve\n) print 6 { pop } repeat } { (close\n) print } pathforall
  newpath
} def
/showpage { } def
)";

class CutFiles : public ::testing::Test {
 protected:
  Sheet read_eps(const std::string& text) const {
    const auto file = [&](const char* name) { return (folder_.path() / name).string(); };
    std::ofstream(file("telling.ps")) << kTellingStroke;
    std::ofstream(file("cut.eps"), std::ios::binary) << text;
    // The resolution is that of the coordinates that come back.
    const std::string command = "gs -q -dBATCH -dNOPAUSE -dSAFER -sDEVICE=nullpage -r2880 " + file("telling.ps") + " " +
                                file("cut.eps") + " >" + file("told") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe): a test has one thread here
    Sheet sheet;
    constexpr double kMm = 25.4 / 72 / 10000;
    std::ifstream told(file("told"));
    for (std::string line; std::getline(told, line);) {
      std::istringstream words(line);
      std::string word;
      double a = 0, b = 0, c = 0, width = 0;
      words >> word >> a >> b >> c >> width;
      if (word == "stroke") {
        const std::string layer = c > 0 ? "engrave" : "cut";
        sheet.colours[layer] = std::to_string(a / 10000) + " " + std::to_string(b / 10000);
        sheet.strokes.push_back({layer, "", {}, false});
        EXPECT_LT(width * kMm, 0.0254) << "laser programs take wider lines for areas";
      } else if (word == "move" || word == "line") {
        EXPECT_EQ(word == "move", sheet.strokes.back().path.empty());
        sheet.strokes.back().path.push_back(point<BedFrame>(a * kMm, b * kMm));
      } else {
        EXPECT_EQ(word, "close") << line;
        if (sheet.strokes.empty()) break;
        sheet.strokes.back().closed = true;
      }
    }
    const auto box = text.find("%%HiResBoundingBox: 0 0 ");
    EXPECT_NE(box, std::string::npos);
    EXPECT_EQ(std::sscanf(text.c_str() + box + 24, "%lf %lf", &sheet.width, &sheet.height), 2);
    sheet.width *= 25.4 / 72, sheet.height *= 25.4 / 72;
    return sheet;
  }

  // What Ghostscript draws of a file of 40 x 30 mm, grey.
  cv::Mat drawn(const std::string& text, const std::string& name) const {
    const auto file = [&](const std::string& its) { return (folder_.path() / its).string(); };
    std::ofstream(file(name), std::ios::binary) << text;
    const std::string command =
        "gs -q -dBATCH -dNOPAUSE -dSAFER -sDEVICE=pnggray -r300 -dDEVICEWIDTHPOINTS=114 -dDEVICEHEIGHTPOINTS=86 "
        "-dFIXEDMEDIA -sOutputFile=" +
        file(name + ".png") + " " + file(name);
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe): a test has one thread here
    return cv::imread(file(name + ".png"), cv::IMREAD_GRAYSCALE);
  }

 private:
  veneer::testing::TempDirectory folder_;
};

void expect_alike(const Sheet& got, const Sheet& want) {
  EXPECT_NEAR(got.width, want.width, 0.001);
  EXPECT_NEAR(got.height, want.height, 0.001);
  ASSERT_EQ(got.strokes.size(), want.strokes.size());
  for (std::size_t i = 0; i < got.strokes.size(); ++i) {
    const ReadStroke &a = got.strokes[i], &b = want.strokes[i];
    EXPECT_EQ(a.layer, b.layer);
    EXPECT_EQ(a.closed, b.closed);
    ASSERT_EQ(a.path.size(), b.path.size());
    for (std::size_t k = 0; k < a.path.size(); ++k) EXPECT_LT(distance(a.path[k], b.path[k]).count(), 0.001);
  }
}

Plan plan_of(Millimetres patch, Millimetres side) {
  PlanOptions options;
  options.patch = patch, options.dpi = 50.8, options.rotations = 5, options.threads = 1, options.kerf = 0.2_mm;
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, side, 1)};
  const std::vector<StockPanel> stock{test::wood_panel("P-1", 60, 60, 50.8, 2), test::wood_panel("Q", 50, 40, 50.8, 3)};
  return make_plan(artworks, stock, options).value();
}

CutDrawing drawing_of_small_plan() {
  const Plan plan = plan_of(10_mm, 50_mm);
  return draw_cuts(plan, plan.panels[0]).value();
}

TEST_F(CutFiles, ShowTheBackWithTheBeamsPath) {
  const Plan plan = plan_of(10_mm, 50_mm);
  ASSERT_GT(unfilled(plan), 0U);
  const PlanPanel& panel = plan.panels[0];
  const auto drawing = draw_cuts(plan, panel);
  ASSERT_TRUE(drawing.ok()) << drawing.error().message;
  EXPECT_THAT(drawing->warnings, IsEmpty());
  const Sheet sheet = sheet_of_svg(cut_svg(*drawing));
  std::ptrdiff_t cuts = 0, engraved = 0;
  for (const ReadStroke& stroke : sheet.strokes) {
    if (stroke.layer != "cut") {
      ++engraved;
      continue;
    }
    ++cuts;
    EXPECT_TRUE(stroke.closed);
    const auto piece =
        std::find_if(plan.pieces.begin(), plan.pieces.end(), [&](const Piece& p) { return p.mark == stroke.piece; });
    ASSERT_TRUE(piece != plan.pieces.end() && piece->placement);
    // The outline grown by half the kerf, mirrored: compare bounding boxes and area.
    Ring<PanelFrame> ring;
    for (const auto& p : stroke.path) ring.push_back({panel.width - p.x, p.y});
    const auto& outline = piece->panel_outline();
    const Box<PanelFrame> want = bounds(outline), got = bounds(ring);
    const double side = distance(outline[0], outline[1]).count(), other = distance(outline[1], outline[2]).count();
    EXPECT_NEAR(std::abs(signed_area(ring)), (side + 0.2) * (other + 0.2), 0.05);
    EXPECT_NEAR((got.min.x + got.max.x).count(), (want.min.x + want.max.x).count(), 0.01);
    EXPECT_NEAR((got.min.y + got.max.y).count(), (want.min.y + want.max.y).count(), 0.01);
  }
  EXPECT_EQ(cuts, std::count_if(plan.pieces.begin(), plan.pieces.end(),
                                [&](const Piece& p) { return p.placement && p.placement->panel == panel.id; }));
  EXPECT_GT(engraved, 0);
}

TEST_F(CutFiles, DxfShowsWhatTheSvgShows) {
  const CutDrawing drawing = drawing_of_small_plan();
  const Sheet svg = sheet_of_svg(cut_svg(drawing));
  DxfReader dxf = read_dxf(cut_dxf(drawing));
  expect_alike(dxf.sheet, svg);
  for (std::size_t i = 0; i < svg.strokes.size(); ++i) EXPECT_EQ(dxf.sheet.strokes[i].piece, svg.strokes[i].piece);
  EXPECT_EQ(dxf.sheet.colours["engrave"], "5");  // blue
  EXPECT_EQ(dxf.sheet.colours["cut"], "1");      // red
}

TEST_F(CutFiles, DxfIsSoundForProgramsThatLookThroughItsObjects) {
  // dxflib looks at no handles: codes and values are read as they come.
  const std::string text = cut_dxf(drawing_of_small_plan());
  EXPECT_EQ(read_dxf(text).texts["$ACADVER"], "AC1015");
  std::vector<std::string> handles, owners;
  std::string seed, before;
  std::istringstream lines(text);
  for (std::string code, value; std::getline(lines, code) && std::getline(lines, value); before = value) {
    if (code == "5" || code == "105") (before == "$HANDSEED" ? seed : handles.emplace_back()) = value;
    if (code == "330") owners.push_back(value);
  }
  EXPECT_GT(handles.size(), 20U);
  EXPECT_GE(owners.size(), handles.size());
  const std::set<std::string> known(handles.begin(), handles.end());
  EXPECT_EQ(known.size(), handles.size());
  for (const std::string& owner : owners) EXPECT_TRUE(owner == "0" || known.count(owner) == 1) << owner;
  const auto number = [](const std::string& handle) { return std::stoul(handle, nullptr, 16); };
  for (const std::string& handle : handles) EXPECT_LT(number(handle), number(seed));
}

TEST_F(CutFiles, EpsShowsWhatTheSvgShows) {
  const CutDrawing drawing = drawing_of_small_plan();
  const std::string text = cut_eps(drawing);
  Sheet eps = read_eps(text);
  expect_alike(eps, sheet_of_svg(cut_svg(drawing)));
  EXPECT_EQ(eps.colours["engrave"], "0.000000 0.000000");
  EXPECT_EQ(eps.colours["cut"], "1.000000 0.000000");
  // 60 pixels of 0.5 mm.
  EXPECT_THAT(text, StartsWith("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 86 86\n"));
}

TEST_F(CutFiles, OpenStrokesStayOpenAndNothingIsLostBeyondThePanel) {
  CutDrawing drawing{"t", 700_mm, 300_mm, {{"engrave", CutColour::kBlue, {}}, {"cut", CutColour::kRed, {}}}, {}};
  drawing.layers[0].strokes.push_back({"A1-1", {point<BedFrame>(1, 2), point<BedFrame>(699.9996, 299.9994)}, false});
  drawing.layers[1].strokes.push_back(
      {"A1-1", {point<BedFrame>(-0.0751, 0), point<BedFrame>(0.5, -0.075), point<BedFrame>(700.25, 1e-9)}, true});
  drawing.layers[1].strokes.push_back({"A1-2", {point<BedFrame>(5, 6), point<BedFrame>(5, 7)}, false});
  const Sheet svg = sheet_of_svg(cut_svg(drawing));
  ASSERT_EQ(svg.strokes.size(), 3U);
  EXPECT_LT(distance(svg.strokes[1].path[2], point<BedFrame>(700.25, 0)).count(), 0.001);
  expect_alike(read_dxf(cut_dxf(drawing)).sheet, svg);
  expect_alike(read_eps(cut_eps(drawing)), svg);
}

// A lens: half a circle of 10 mm, and the chord that closes it. As the planner flattens it, 0.01 mm from the curve.
CutDrawing drawing_of_half_a_circle() {
  CutDrawing drawing{"t", 40_mm, 30_mm, {{"engrave", CutColour::kBlue, {}}, {"cut", CutColour::kRed, {}}}, {}};
  DrawnPath stroke{"A1-1", {}, true, true};
  constexpr int kChords = 40;
  for (int i = 0; i <= kChords; ++i)
    stroke.path.push_back(point<BedFrame>(20 + 10 * std::cos(kPi * i / kChords), 5 + 10 * std::sin(kPi * i / kChords)));
  drawing.layers[1].strokes.push_back(stroke);
  return drawing;
}

// Points of Bezier curves, from their controls.
Polyline<BedFrame> sampled(const Polyline<BedFrame>& controls) {
  Polyline<BedFrame> out;
  for (std::size_t i = 0; i + 3 < controls.size(); i += 3)
    for (int k = 0; k <= 20; ++k) {
      const double t = k / 20.0, s = 1 - t;
      const auto blend = [&](auto of) {
        return s * s * s * of(controls[i]) + 3 * s * s * t * of(controls[i + 1]) + 3 * s * t * t * of(controls[i + 2]) +
               t * t * t * of(controls[i + 3]);
      };
      out.push_back(point<BedFrame>(blend([](const auto& p) { return p.x.count(); }),
                                    blend([](const auto& p) { return p.y.count(); })));
    }
  return out;
}

// Each lies on the half circle, or on its chord.
void expect_on_the_lens(const Polyline<BedFrame>& points) {
  ASSERT_FALSE(points.empty());
  for (const auto& p : points) {
    const double to_arc = std::abs(distance(p, point<BedFrame>(20, 5)).count() - 10);
    EXPECT_LT(std::min(to_arc, std::abs(p.y.count() - 5)), 0.025) << p.x.count() << ", " << p.y.count();
  }
}

TEST_F(CutFiles, CurvesAreCurvesInEachFormat) {
  const CutDrawing drawing = drawing_of_half_a_circle();
  const auto segments = drawing.layers[1].strokes[0].segments();
  ASSERT_LE(segments.size(), 6U) << "a few curves for forty chords";
  EXPECT_FALSE(segments.back().curved) << "the chord";
  // SVG: M, some C with three points each, Z.
  const std::string svg = cut_svg(drawing);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(svg.c_str()));
  std::string data = document.select_node("//path").node().attribute("d").value();
  const auto curves = std::count(data.begin(), data.end(), 'C');
  EXPECT_EQ(static_cast<std::size_t>(curves) + 1, segments.size());
  for (char& c : data)
    if (c == 'M' || c == 'C' || c == 'Z' || c == ',') c = ' ';
  Polyline<BedFrame> controls;
  std::istringstream numbers(data);
  for (double x = 0, y = 0; numbers >> x >> y;) controls.push_back(point<BedFrame>(x, 30 - y));
  ASSERT_EQ(controls.size() % 3, 1U);
  expect_on_the_lens(sampled(controls));
  // DXF: a spline of Bezier curves, the chord among them.
  struct SplineReader : DL_CreationAdapter {
    void addSpline(const DL_SplineData& spline) override { degree = spline.degree, flags = spline.flags; }
    void addControlPoint(const DL_ControlPointData& p) override { controls.push_back(point<BedFrame>(p.x, p.y)); }
    void addKnot(const DL_KnotData& knot) override { knots.push_back(knot.k); }
    unsigned degree = 0;
    int flags = 0;
    Polyline<BedFrame> controls;
    std::vector<double> knots;
  } dxf;
  std::stringstream stream(cut_dxf(drawing));
  ASSERT_TRUE(DL_Dxf().in(stream, &dxf));
  EXPECT_EQ(dxf.degree, 3U);
  EXPECT_EQ(dxf.flags & 1, 1) << "closed";
  EXPECT_EQ(dxf.controls.size(), 3 * segments.size() + 1);
  EXPECT_EQ(dxf.knots.size(), dxf.controls.size() + 4);
  EXPECT_TRUE(std::is_sorted(dxf.knots.begin(), dxf.knots.end()));
  expect_on_the_lens(sampled(dxf.controls));
  // EPS and PDF: Ghostscript tells the curves of the one, and draws both alike.
  const std::string eps = cut_eps(drawing), pdf = cut_pdf(drawing);
  EXPECT_THAT(eps, HasSubstr("curveto"));
  const auto ink = [&](const std::string& file, const std::string& name) {
    const cv::Mat picture = drawn(file, name);
    cv::Mat dark;
    cv::threshold(picture, dark, 250, 255, cv::THRESH_BINARY_INV);
    return dark;
  };
  const cv::Mat of_eps = ink(eps, "cut.eps"), of_pdf = ink(pdf, "cut.pdf");
  ASSERT_EQ(of_eps.size(), of_pdf.size());
  // Each dot of the one lies within a dot of the other.
  for (const auto& [one, other] : {std::pair(of_eps, of_pdf), {of_pdf, of_eps}}) {
    cv::Mat wide;
    cv::dilate(other, wide, cv::Mat::ones(5, 5, CV_8U));
    EXPECT_GT(cv::countNonZero(one), 500);
    EXPECT_EQ(cv::countNonZero(one & ~wide), 0);
  }
}

TEST_F(CutFiles, NoNameCanBreakAFile) {
  const std::string name = "a\n0\nEOF\n(b\\) showpage \xC3\xB6 )\r";
  CutDrawing drawing{name, 10_mm, 10_mm, {{"engrave", CutColour::kBlue, {}}, {"cut", CutColour::kRed, {}}}, {}};
  for (const double y : {1, 2})
    drawing.layers[1].strokes.push_back({name, {point<BedFrame>(1, y), point<BedFrame>(2, y)}, false});
  const Sheet svg = sheet_of_svg(cut_svg(drawing));
  ASSERT_EQ(svg.strokes.size(), 2U);
  const Sheet dxf = read_dxf(cut_dxf(drawing)).sheet;
  expect_alike(dxf, svg);
  EXPECT_EQ(dxf.strokes.back().piece, "a?0?EOF?(b\\) showpage ?? )?");
  expect_alike(read_eps(cut_eps(drawing)), svg);
}

TEST_F(CutFiles, TellInOneSentenceHowManyMarksFoundNoRoom) {
  const Plan plan = plan_of(3.5_mm, 14_mm);
  const auto drawing = draw_cuts(plan, plan.panels[0]);
  ASSERT_TRUE(drawing.ok()) << drawing.error().message;
  ASSERT_EQ(drawing->warnings.size(), 1U);
  std::vector<std::string> here;
  for (const Piece& piece : plan.pieces)
    if (piece.placement && piece.placement->panel == plan.panels[0].id) here.push_back(piece.mark);
  ASSERT_FALSE(here.empty());
  EXPECT_THAT(drawing->warnings[0], StartsWith(std::to_string(here.size()) + " marks do not fit"));
  EXPECT_THAT(drawing->warnings[0], HasSubstr(here[0]));
}

}  // namespace
}  // namespace veneer::planner
