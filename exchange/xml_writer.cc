#include "exchange/xml_writer.h"

#include <algorithm>

namespace sixpoint::exchange {
namespace {

bool IsSpecial(char c) { return c == '&' || c == '<' || c == '>' || c == '"' || c == '\t' || c == '\n' || c == '\r'; }

std::string_view EscapeOf(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    // As they are, a reader makes blanks or other ends of line of them.
    case '\t':
      return "&#9;";
    case '\n':
      return "&#10;";
    default:
      return "&#13;";
  }
}

}  // namespace

XmlWriter::XmlWriter() {
  text_.reserve(std::size_t{1} << 15);  // a blade's
  text_ = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
}

XmlWriter& XmlWriter::Open(std::string_view name, const Attributes& attributes) {
  Tag(name, attributes);
  text_ += ">\n";
  open_.emplace_back(name);
  return *this;
}

XmlWriter& XmlWriter::Close() {
  const std::string name = std::move(open_.back());
  open_.pop_back();
  text_.append(open_.size(), ' ');
  text_ += "</";
  text_ += name;
  text_ += ">\n";
  return *this;
}

XmlWriter& XmlWriter::Element(std::string_view name, std::string_view text, const Attributes& attributes) {
  Tag(name, attributes);
  text_ += '>';
  Escaped(text);
  text_ += "</";
  text_ += name;
  text_ += ">\n";
  return *this;
}

XmlWriter& XmlWriter::Empty(std::string_view name, const Attributes& attributes) {
  Tag(name, attributes);
  text_ += "/>\n";
  return *this;
}

XmlWriter& XmlWriter::ElementUnlessEmpty(std::string_view name, std::string_view text) {
  return text.empty() ? *this : Element(name, text);
}

void XmlWriter::Tag(std::string_view name, const Attributes& attributes) {
  text_.append(open_.size(), ' ');
  text_ += '<';
  text_ += name;
  for (const auto& [attribute, value] : attributes) {
    text_ += ' ';
    text_ += attribute;
    text_ += "=\"";
    Escaped(value);
    text_ += '"';
  }
}

void XmlWriter::Escaped(std::string_view text) {
  for (;;) {
    const auto* const special = std::find_if(text.begin(), text.end(), IsSpecial);
    text_.append(text.begin(), special);
    if (special == text.end()) return;
    text_ += EscapeOf(*special);
    text.remove_prefix(static_cast<std::size_t>(special - text.begin()) + 1);
  }
}

}  // namespace sixpoint::exchange
