// The two faces of a panel.
#pragma once

namespace veneer {

enum class Face {
  kShow,  // what people will see
  kBack,  // what is engraved and cut from
};
constexpr Face other(Face face) { return face == Face::kShow ? Face::kBack : Face::kShow; }
constexpr const char* to_string(Face face) { return face == Face::kShow ? "show" : "back"; }

}  // namespace veneer
