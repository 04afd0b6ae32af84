#include "tests/gallery/page.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>

namespace veneer::gallery {
namespace {

using nlohmann::json;
using pugi::xml_node;

xml_node add(xml_node parent, const char* name, const char* css_class = "") {
  xml_node out = parent.append_child(name);
  if (*css_class != '\0') out.append_attribute("class") = css_class;
  return out;
}

xml_node add_text(xml_node parent, const char* name, const std::string& text, const char* css_class = "") {
  xml_node out = add(parent, name, css_class);
  out.append_child(pugi::node_pcdata).set_value(text.c_str());
  return out;
}

xml_node add_link(xml_node parent, const std::string& address) {
  xml_node out = add(parent, "a");
  out.append_attribute("href") = address.c_str();
  return out;
}

void add_head(xml_node html, const std::string& title) {
  xml_node head = add(html, "head");
  add(head, "meta").append_attribute("charset") = "utf-8";
  xml_node viewport = add(head, "meta");
  viewport.append_attribute("name") = "viewport";
  viewport.append_attribute("content") = "width=device-width, initial-scale=1";
  xml_node scheme = add(head, "meta");
  scheme.append_attribute("name") = "color-scheme";
  scheme.append_attribute("content") = "light dark";
  add_text(head, "title", title);
  xml_node style = add(head, "link");
  style.append_attribute("rel") = "stylesheet";
  style.append_attribute("href") = "page.css";
}

void add_figure_line(xml_node list, const char* name, const std::string& value) {
  xml_node line = add(list, "div");
  add_text(line, "dt", name);
  add_text(line, "dd", value);
}

void add_figures(xml_node caption, const PlanFigures& figures) {
  xml_node list = add(caption, "dl");
  add_figure_line(list, "pieces",
                  figures.unfilled == 0 ? fmt::format("{}", figures.pieces)
                                        : fmt::format("{}, {} without wood", figures.pieces, figures.unfilled));
  if (figures.preview_cost_per_pixel)
    add_figure_line(list, "preview cost", fmt::format("{:.5f}", *figures.preview_cost_per_pixel));
  add_figure_line(list, "cost of pieces", fmt::format("{:.5f}", figures.cost_per_pixel));
  add_figure_line(list, "wood", fmt::format("{:.0f} cm\u00b2", figures.wood_cm2));
  add_figure_line(list, "time", fmt::format("{:.1f} s", figures.seconds));
}

void add_view(xml_node row, const ShownView& view) {
  xml_node figure = add(row, "figure");
  if (view.error.empty()) {
    xml_node picture = add(add_link(figure, view.full), "img");
    picture.append_attribute("src") = view.picture.c_str();
    picture.append_attribute("alt") = view.caption.c_str();
    picture.append_attribute("width") = view.size.width;
    picture.append_attribute("height") = view.size.height;
    picture.append_attribute("loading") = "lazy";
  } else {
    add_text(figure, "p", "This failed: " + view.error, "failed");
  }
  xml_node caption = add(figure, "figcaption");
  add_text(caption, "strong", view.caption);
  if (view.figures) add_figures(caption, *view.figures);
  if (view.command.empty()) return;
  xml_node details = add(caption, "details");
  add_text(details, "summary", "how it was made");
  add_text(details, "code", view.command);
}

void add_study(xml_node parent, const ShownStudy& shown) {
  const Study& study = *shown.study;
  xml_node section = add(parent, "section", "study");
  section.append_attribute("id") = study.key.c_str();
  xml_node heading = add(section, "h3");
  add_text(heading, "span", study.figure, "number");
  add_text(heading, "span", study.title);
  add_text(section, "p", study.look_at, "look");
  if (!shown.views.empty()) {
    xml_node row = add(section, "div", fmt::format("row columns-{}", study.columns).c_str());
    for (const ShownView& view : shown.views) add_view(row, view);
  }
  if (study.not_there.empty()) return;
  xml_node missing = add(section, "ul", "missing");
  for (const std::string& sentence : study.not_there) {
    xml_node item = add(missing, "li");
    add_text(item, "b", "Not there: ");
    add_text(item, "span", sentence);
  }
}

void add_contents(xml_node parent, const Gallery& gallery) {
  xml_node contents = add(parent, "nav");
  for (const ShownPaper& paper : gallery.papers) {
    add_text(contents, "h4", paper.paper->title);
    xml_node list = add(contents, "ul");
    for (const ShownStudy& study : paper.studies) {
      xml_node link = add_link(add(list, "li"), "#" + study.study->key);
      add_text(link, "span", study.study->figure, "number");
      add_text(link, "span", study.study->title);
    }
  }
}

json figures_json(const PlanFigures& figures) {
  return {{"pieces", figures.pieces},
          {"unfilled", figures.unfilled},
          {"preview_cost_per_pixel",
           figures.preview_cost_per_pixel ? json(*figures.preview_cost_per_pixel) : json(nullptr)},
          {"cost_per_pixel", figures.cost_per_pixel},
          {"seconds", figures.seconds},
          {"wood_cm2", figures.wood_cm2}};
}

json view_json(const ShownView& view) {
  json out{{"caption", view.caption}};
  out["picture"] = view.error.empty() ? json(view.full) : json(nullptr);
  out["figures"] = view.figures ? figures_json(*view.figures) : json(nullptr);
  out["command"] = view.command.empty() ? json(nullptr) : json(view.command);
  out["error"] = view.error.empty() ? json(nullptr) : json(view.error);
  return out;
}

Error cannot_write(const std::filesystem::path& file) {
  return {ErrorCode::kStorage, fmt::format("cannot write {}: check the folder and the disk", file.string())};
}

}  // namespace

std::size_t failures(const Gallery& gallery) {
  std::size_t out = 0;
  for (const ShownPaper& paper : gallery.papers)
    for (const ShownStudy& study : paper.studies)
      for (const ShownView& view : study.views) out += view.error.empty() ? 0 : 1;
  return out;
}

Status write_page(const Gallery& gallery, const std::filesystem::path& file) {
  pugi::xml_document document;
  document.append_child(pugi::node_doctype).set_value("html");
  xml_node html = add(document.root(), "html");
  html.append_attribute("lang") = "en";
  add_head(html, gallery.title);
  xml_node body = add(html, "body");
  xml_node header = add(body, "header");
  add_text(header, "h1", gallery.title);
  add_text(header, "p", gallery.lead, "lead");
  add_text(header, "p", gallery.made_of, "made");
  add_text(
      header, "p",
      "Preview cost: how far the finished picture is from the target in tone and in edges, on the mean over its "
      "pixels, seams included; the smaller the nearer. Cost of pieces: the same of each piece by itself. Times are "
      "of the machine that made this page.",
      "made");
  add_contents(header, gallery);
  xml_node main = add(body, "main");
  for (const ShownPaper& paper : gallery.papers) {
    add_text(main, "h2", paper.paper->title);
    add_text(main, "p", paper.paper->by, "by");
    for (const ShownStudy& study : paper.studies) add_study(main, study);
  }
  xml_node footer = add(body, "footer");
  add_text(footer, "p", fmt::format("Made in {:.0f} s. All figures are in report.json.", gallery.seconds));
  std::ofstream out(file, std::ios::binary);
  // Blanks between elements are blanks on the page.
  document.save(out, "", pugi::format_raw | pugi::format_no_declaration, pugi::encoding_utf8);
  out.flush();
  return out ? Ok() : Status(cannot_write(file));
}

Status write_report(const Gallery& gallery, const std::filesystem::path& file) {
  json studies = json::array();
  for (const ShownPaper& paper : gallery.papers)
    for (const ShownStudy& study : paper.studies) {
      json views = json::array();
      for (const ShownView& view : study.views) views.push_back(view_json(view));
      studies.push_back({{"key", study.study->key},
                         {"paper", paper.paper->title},
                         {"figure", study.study->figure},
                         {"views", std::move(views)},
                         {"not_there", study.study->not_there}});
    }
  std::ofstream out(file, std::ios::binary);
  out << json{{"schema_version", 1},
              {"seconds", gallery.seconds},
              {"failed", failures(gallery)},
              {"studies", std::move(studies)}}
             .dump(2)
      << '\n';
  out.flush();
  return out ? Ok() : Status(cannot_write(file));
}

}  // namespace veneer::gallery
