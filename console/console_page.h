// The operator's page, embedded: it needs no build, no network and no files beside the daemon.
#pragma once

#include <span>
#include <string_view>

namespace veneer::console {

struct PageFile {
  std::string_view path;  // where the browser asks for it
  std::string_view content_type;
  std::string_view content;
};

std::span<const PageFile> page_files();
// Shown after STOP to a browser without scripts; at no address of its own, since it says that STOP was taken.
const PageFile& stopped_page();

}  // namespace veneer::console
