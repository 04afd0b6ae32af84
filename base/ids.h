// Distinct types for the names of things, so that a job's number cannot be passed where a panel's is wanted.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace veneer {

// A number the database hands out. 0 is "none yet".
template <class Tag>
struct NumericId {
  std::int64_t value = 0;
  friend auto operator<=>(const NumericId&, const NumericId&) = default;
};

// A name people read and type.
template <class Tag>
struct NamedId {
  std::string value;
  friend auto operator<=>(const NamedId&, const NamedId&) = default;
};

using PanelId = NamedId<struct PanelIdTag>;  // "P-0001", on the label of the panel
using JobId = NumericId<struct JobIdTag>;
using PieceId = NumericId<struct PieceIdTag>;  // global, for ever; the mark on the wood is unique only within its job
using ScanId = NumericId<struct ScanIdTag>;
using CertificateId = NumericId<struct CertificateIdTag>;

}  // namespace veneer

template <class Tag>
struct std::hash<veneer::NumericId<Tag>> {
  std::size_t operator()(const veneer::NumericId<Tag>& id) const noexcept {
    return std::hash<std::int64_t>{}(id.value);
  }
};
template <class Tag>
struct std::hash<veneer::NamedId<Tag>> {
  std::size_t operator()(const veneer::NamedId<Tag>& id) const noexcept { return std::hash<std::string>{}(id.value); }
};
