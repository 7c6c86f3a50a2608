#include "exchange/xml_writer.h"

namespace sixpoint::exchange {

XmlWriter::XmlWriter() : text_("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n") {}

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
  text_ += "</" + name + ">\n";
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
  for (const char c : text) {
    switch (c) {
      case '&':
        text_ += "&amp;";
        break;
      case '<':
        text_ += "&lt;";
        break;
      case '>':
        text_ += "&gt;";
        break;
      case '"':
        text_ += "&quot;";
        break;
      // As they are, a reader makes blanks or other ends of line of them.
      case '\t':
        text_ += "&#9;";
        break;
      case '\n':
        text_ += "&#10;";
        break;
      case '\r':
        text_ += "&#13;";
        break;
      default:
        text_ += c;
    }
  }
}

}  // namespace sixpoint::exchange
