#include "refusal/message_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace sixpoint {
namespace {

template <typename... Format>
std::string Written(double value, Format... format) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  char buffer[64];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value, format...).ptr);
}

// Bytes of the character there, of UTF-8 as RFC 3629 has it; 0: none begins there.
std::size_t CharacterAt(const std::string& text, std::size_t begin) {
  const auto byte = [&](std::size_t i) -> unsigned {
    return begin + i < text.size() ? static_cast<unsigned char>(text[begin + i]) : 0;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xc2 && first <= 0xdf   ? 2
                             : first >= 0xe0 && first <= 0xef ? 3
                             : first >= 0xf0 && first <= 0xf4 ? 4
                                                              : 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  // Longer than need be, half of a pair, beyond the last character.
  const bool wrong = (first == 0xe0 && byte(1) < 0xa0) || (first == 0xed && byte(1) > 0x9f) ||
                     (first == 0xf0 && byte(1) < 0x90) || (first == 0xf4 && byte(1) > 0x8f);
  return wrong ? 0 : length;
}

}  // namespace

std::string NumberText(double value) {
  constexpr double kWholeBelow = 1e15;  // from there on neighbours are more than a digit apart
  if (std::abs(value) < kWholeBelow && std::trunc(value) == value) return Written(value, std::chars_format::fixed);
  return Written(value);
}

std::string Rounded(double value) { return Written(value, std::chars_format::general, 6); }

std::string Tame(std::string text, std::size_t longest) {
  constexpr std::size_t kDots = 3;
  if (text.size() > longest) {
    longest -= kDots;
    while (longest > 0 && (static_cast<unsigned char>(text[longest]) & 0xc0) == 0x80) --longest;
    text = text.substr(0, longest) + "...";
  }
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = CharacterAt(text, i);
    if (length == 0 || static_cast<unsigned char>(text[i]) < 0x20 || text[i] == 0x7f) text[i] = '?';
    // U+0080 to U+009F: controls of a terminal too.
    if (length == 2 && text[i] == '\xc2' && static_cast<unsigned char>(text[i + 1]) < 0xa0) text[i] = text[i + 1] = '?';
    i += std::max<std::size_t>(length, 1);
  }
  return text;
}

}  // namespace sixpoint
