// A page that is drawn in millimetres, y running down from its upper left corner, and comes out as a file's bytes. The
// drawing itself is cairo's. Not for several threads at once; separate pages are independent.
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "base/units.h"

struct _cairo;  // NOLINT(bugprone-reserved-identifier): cairo_t, for those who do not draw

namespace veneer::planner {

enum class PageFormat { kPdf, kSvg, kPng };  // PNG: 300 dots per inch

// "image/svg+xml" and the like.
std::string content_type_of(PageFormat format);
// "pdf", "svg" or "png", as requests name them; anything else is PDF.
PageFormat page_format(const std::string& name);

class PrintedPage {
 public:
  // kBare: nothing lies under what is drawn, for files that machines follow.
  enum class Ground { kWhite, kBare };
  // Letters have the widths their outlines have, not whole pixels.
  PrintedPage(Millimetres width, Millimetres height, PageFormat format, Ground ground = Ground::kWhite);
  ~PrintedPage();
  PrintedPage(const PrintedPage&) = delete;
  PrintedPage& operator=(const PrintedPage&) = delete;

  _cairo* context() const;
  // Ends the page and begins another of the same size. Only PDF has more than one.
  void next_page();
  // The file's bytes; nothing can be drawn afterwards. kInternal: cairo could not draw it, or text was no UTF-8.
  Result<std::string> finish();

 private:
  struct Canvas;
  void clear() const;

  PageFormat format_;
  Ground ground_;
  std::unique_ptr<Canvas> canvas_;
};

}  // namespace veneer::planner
