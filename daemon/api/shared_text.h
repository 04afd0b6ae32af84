// Bytes that several hold and nobody changes: a picture of 48 MB must not be copied on the loop that answers STOP.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace veneer::daemon {

class SharedText {
 public:
  SharedText() : SharedText(std::string()) {}
  SharedText(std::string text)  // NOLINT(google-explicit-constructor): it is a text
      : text_(std::make_shared<const std::string>(std::move(text))) {}
  SharedText(const char* text) : SharedText(std::string(text)) {}  // NOLINT(google-explicit-constructor)

  const std::string& text() const { return *text_; }
  std::string_view view() const { return *text_; }
  bool empty() const { return text_->empty(); }
  std::size_t size() const { return text_->size(); }
  friend bool operator==(const SharedText& a, const SharedText& b) { return *a.text_ == *b.text_; }

 private:
  std::shared_ptr<const std::string> text_;
};

}  // namespace veneer::daemon
