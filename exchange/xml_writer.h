// Writes XML in one pass: what is opened is closed in order, texts and attribute values are escaped.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sixpoint::exchange {

class XmlWriter {
 public:
  using Attributes = std::vector<std::pair<std::string_view, std::string>>;

  XmlWriter();
  XmlWriter& Open(std::string_view name, const Attributes& attributes = {});
  XmlWriter& Close();
  XmlWriter& Element(std::string_view name, std::string_view text, const Attributes& attributes = {});
  // Without content.
  XmlWriter& Empty(std::string_view name, const Attributes& attributes = {});
  // Nothing where the text is empty.
  XmlWriter& ElementUnlessEmpty(std::string_view name, std::string_view text);
  // What a writer that was at the same depth has written.
  XmlWriter& Written(std::string_view elements) {
    text_ += elements;
    return *this;
  }
  std::string_view written() const { return text_; }
  // Once all is closed.
  std::string Take() { return std::move(text_); }

 private:
  void Tag(std::string_view name, const Attributes& attributes);
  void Escaped(std::string_view text);

  std::string text_;
  std::vector<std::string> open_;
};

}  // namespace sixpoint::exchange
