#include "refusal/message_text.h"

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
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

}  // namespace sixpoint
