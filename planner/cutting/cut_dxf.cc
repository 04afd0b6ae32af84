// cut-<panel>.dxf: groups of a code and a value, each on its line, as the DXF Reference of AutoCAD 2000 lists them.
//
// Why this version: R12 needs a quarter of this, but has no $INSUNITS, and what has no unit is scaled by 25.4 sooner or
// later. Why by hand: Debian's library for it, libdxflib, is under the GPL, and most of what follows is left to its
// callers. The tests read the file with it.
#include <fmt/format.h>

#include <vector>

#include "planner/cutting/cut_drawing.h"
#include "planner/cutting/plain_ascii.h"

namespace veneer::planner {
namespace {

struct Group {
  int code;
  std::string value;
};
using Groups = std::vector<Group>;

std::string mm(Millimetres length) { return fmt::format("{:.4f}", length.count()); }

// Every object has a handle, a number in hexadecimal, and names its owner's.
class DxfText {
 public:
  void put(const Groups& groups) {
    for (const Group& group : groups) fmt::format_to(std::back_inserter(text_), "{}\n{}\n", group.code, group.value);
  }
  std::string next_handle() { return fmt::format("{:X}", ++last_handle_); }
  // Returns its handle.
  std::string object(const char* type, const std::string& owner, const Groups& groups, int handle_code = 5) {
    std::string handle = next_handle();
    put({{0, type}, {handle_code, handle}, {330, owner}});
    put(groups);
    return handle;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  int last_handle_ = 0;
};

struct Entry {
  std::string name;
  Groups groups;
};

// Returns the entries' handles.
std::vector<std::string> put_table(DxfText& out, const char* type, const char* subclass,
                                   const std::vector<Entry>& entries, const Groups& more = {}) {
  const std::string table = out.next_handle();
  out.put({{0, "TABLE"}, {2, type}, {5, table}, {330, "0"}, {100, "AcDbSymbolTable"}});
  out.put({{70, std::to_string(entries.size())}});
  out.put(more);
  std::vector<std::string> handles;
  const int handle_code = std::string_view(type) == "DIMSTYLE" ? 105 : 5;
  for (const Entry& entry : entries) {
    handles.push_back(
        out.object(type, table, {{100, "AcDbSymbolTableRecord"}, {100, subclass}, {2, entry.name}}, handle_code));
    out.put(entry.groups);
  }
  out.put({{0, "ENDTAB"}});
  return handles;
}

// The view that a program opens with: the whole panel, from above.
Groups view_of(const CutDrawing& drawing) {
  Groups groups{{70, "0"}, {10, "0"}, {20, "0"}, {11, "1"}, {21, "1"}};
  groups.insert(groups.end(), {{12, mm(drawing.width / 2)}, {22, mm(drawing.height / 2)}});
  for (const int code : {13, 23, 14, 24, 15, 25, 16, 26}) groups.push_back({code, "0"});
  groups.insert(groups.end(), {{36, "1"}, {17, "0"}, {27, "0"}, {37, "0"}, {40, mm(drawing.height)}});
  groups.insert(groups.end(), {{41, fmt::format("{:.4f}", drawing.width / drawing.height)}, {42, "50"}});
  for (const int code : {43, 44, 50, 51, 71}) groups.push_back({code, "0"});
  groups.insert(groups.end(), {{72, "100"}, {73, "1"}, {74, "1"}, {75, "0"}, {76, "0"}, {77, "0"}, {78, "0"}});
  return groups;
}

// Returns the handles of model space, where everything is drawn, and of paper space, which stays empty.
std::vector<std::string> put_tables(DxfText& out, const CutDrawing& drawing) {
  const Groups solid{{70, "0"}, {3, ""}, {72, "65"}, {73, "0"}, {40, "0"}};
  std::vector<Entry> layers{{"0", {{70, "0"}, {62, "7"}, {6, "Continuous"}}}};
  for (const CutLayer& layer : drawing.layers)
    layers.push_back(
        {plain_ascii(layer.name), {{70, "0"}, {62, layer.colour == CutColour::kBlue ? "5" : "1"}, {6, "Continuous"}}});
  out.put({{0, "SECTION"}, {2, "TABLES"}});
  put_table(out, "VPORT", "AcDbViewportTableRecord", {{"*Active", view_of(drawing)}});
  put_table(out, "LTYPE", "AcDbLinetypeTableRecord", {{"ByBlock", solid}, {"ByLayer", solid}, {"Continuous", solid}});
  put_table(out, "LAYER", "AcDbLayerTableRecord", layers);
  put_table(out, "STYLE", "AcDbTextStyleTableRecord",
            {{"Standard", {{70, "0"}, {40, "0"}, {41, "1"}, {50, "0"}, {71, "0"}, {42, "2.5"}, {3, "txt"}, {4, ""}}}});
  put_table(out, "VIEW", "AcDbViewTableRecord", {});
  put_table(out, "UCS", "AcDbUCSTableRecord", {});
  put_table(out, "APPID", "AcDbRegAppTableRecord", {{"ACAD", {{70, "0"}}}, {"VENEERD", {{70, "0"}}}});
  put_table(out, "DIMSTYLE", "AcDbDimStyleTableRecord", {{"Standard", {{70, "0"}}}}, {{100, "AcDbDimStyleTable"}});
  auto spaces = put_table(out, "BLOCK_RECORD", "AcDbBlockTableRecord", {{"*Model_Space", {}}, {"*Paper_Space", {}}});
  out.put({{0, "ENDSEC"}});
  return spaces;
}

void put_block(DxfText& out, const char* name, const std::string& space) {
  out.object("BLOCK", space,
             {{100, "AcDbEntity"},
              {8, "0"},
              {100, "AcDbBlockBegin"},
              {2, name},
              {70, "0"},
              {10, "0"},
              {20, "0"},
              {30, "0"},
              {3, name},
              {1, ""}});
  out.object("ENDBLK", space, {{100, "AcDbEntity"}, {8, "0"}, {100, "AcDbBlockEnd"}});
}

// Cubic Bezier curves one after the other are a spline with triple knots; straight parts are curves without a bend.
void put_spline(DxfText& out, const DrawnPath& stroke, const std::vector<PathSegment>& segments,
                const std::string& layer, const std::string& space) {
  constexpr int kClosed = 1, kPlanar = 8;
  const std::size_t controls = 3 * segments.size() + 1;
  out.object("SPLINE", space,
             {{100, "AcDbEntity"},
              {8, plain_ascii(layer)},
              {100, "AcDbSpline"},
              {210, "0"},
              {220, "0"},
              {230, "1"},
              {70, std::to_string(kPlanar | (stroke.closed ? kClosed : 0))},
              {71, "3"},
              {72, std::to_string(controls + 4)},
              {73, std::to_string(controls)},
              {74, "0"},
              {42, "0.0000001"},
              {43, "0.0000001"}});
  for (std::size_t i = 0; i <= segments.size(); ++i)
    for (int times = i == 0 || i == segments.size() ? 4 : 3; times > 0; --times) out.put({{40, std::to_string(i)}});
  const auto put = [&](const Point<BedFrame>& p) { out.put({{10, mm(p.x)}, {20, mm(p.y)}, {30, "0"}}); };
  put(stroke.path.front());
  for (const PathSegment& segment : segments) put(segment.first), put(segment.second), put(segment.to);
  out.put({{1001, "VENEERD"}, {1000, plain_ascii(stroke.piece)}});
}

void put_stroke(DxfText& out, const DrawnPath& stroke, const std::string& layer, const std::string& space) {
  if (const auto segments = stroke.segments(); has_curves(segments))
    return put_spline(out, stroke, segments, layer, space);
  out.object("LWPOLYLINE", space,
             {{100, "AcDbEntity"},
              {8, plain_ascii(layer)},
              {100, "AcDbPolyline"},
              {90, std::to_string(stroke.path.size())},
              {70, stroke.closed ? "1" : "0"}});
  for (const Point<BedFrame>& p : stroke.path) out.put({{10, mm(p.x)}, {20, mm(p.y)}});
  out.put({{1001, "VENEERD"}, {1000, plain_ascii(stroke.piece)}});
}

void put_header(DxfText& out, const CutDrawing& drawing, const std::string& free_handle) {
  out.put({{0, "SECTION"}, {2, "HEADER"}});
  out.put({{9, "$ACADVER"}, {1, "AC1015"}, {9, "$DWGCODEPAGE"}, {3, "ANSI_1252"}});
  out.put({{9, "$INSUNITS"}, {70, "4"}, {9, "$MEASUREMENT"}, {70, "1"}});  // millimetres; metric
  out.put({{9, "$EXTMIN"}, {10, "0"}, {20, "0"}, {30, "0"}});
  out.put({{9, "$EXTMAX"}, {10, mm(drawing.width)}, {20, mm(drawing.height)}, {30, "0"}});
  out.put({{9, "$HANDSEED"}, {5, free_handle}, {0, "ENDSEC"}});
}

}  // namespace

std::string cut_dxf(const CutDrawing& drawing) {
  DxfText body;
  const std::vector<std::string> spaces = put_tables(body, drawing);
  body.put({{0, "SECTION"}, {2, "BLOCKS"}});
  put_block(body, "*Model_Space", spaces[0]);
  put_block(body, "*Paper_Space", spaces[1]);
  body.put({{0, "ENDSEC"}, {0, "SECTION"}, {2, "ENTITIES"}});
  for (const CutLayer& layer : drawing.layers)
    for (const DrawnPath& stroke : layer.strokes) put_stroke(body, stroke, layer.name, spaces[0]);
  body.put({{0, "ENDSEC"}, {0, "SECTION"}, {2, "OBJECTS"}});
  const std::string root = body.next_handle(), groups = body.next_handle();
  body.put({{0, "DICTIONARY"}, {5, root}, {330, "0"}, {100, "AcDbDictionary"}, {281, "1"}});
  body.put({{3, "ACAD_GROUP"}, {350, groups}});
  body.put({{0, "DICTIONARY"}, {5, groups}, {330, root}, {100, "AcDbDictionary"}, {281, "1"}});
  body.put({{0, "ENDSEC"}, {0, "EOF"}});
  DxfText header;
  put_header(header, drawing, body.next_handle());
  return header.text() + body.text();
}

}  // namespace veneer::planner
