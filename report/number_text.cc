#include "report/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "exchange/text.h"
#include "refusal/message_text.h"

namespace sixpoint::report {
namespace {

constexpr std::string_view kMinus = "\u2212";
constexpr int kMostDecimals = 6;

std::string WithMinus(std::string text) {
  const bool negative = !text.empty() && text[0] == '-';
  if (negative && text.find_first_not_of("-0.") == std::string::npos) return text.substr(1);
  return negative ? std::string(kMinus) + text.substr(1) : text;
}

// Moves or hides its neighbours: directions, joiners, ends of line, a byte order mark.
bool Misleads(char32_t c) {
  return c == 0x061c || (c >= 0x200b && c <= 0x200f) || (c >= 0x2028 && c <= 0x202e) || (c >= 0x2060 && c <= 0x206f) ||
         c == 0xfeff || (c >= 0xfff9 && c <= 0xfffb) || (c >= 0xe0000 && c <= 0xe007f);
}

// Signs of tolerances that hardly a font has: told in words, so that none reads a box.
std::string_view WordsFor(char32_t c) {
  switch (c) {
    case 0x2312:
      return "line profile";
    case 0x2313:
      return "profile";
    case 0x2316:
      return "position";
    case 0x232d:
      return "cylindricity";
    case 0x232f:
      return "symmetry";
    case 0x2330:
      return "total run-out";
    case 0x23e4:
      return "straightness";
    case 0x23e5:
      return "flatness";
    case 0x2afd:
      return "parallelism";
    default:
      return "";
  }
}

}  // namespace

std::string Fixed(double value, int decimals) {
  char buffer[400];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, decimals);
  return end.ec == std::errc() ? WithMinus(std::string(buffer, end.ptr)) : "?";
}

std::string Shortest(double value) { return WithMinus(Rounded(value)); }

std::string Signed(double value, int decimals) {
  const std::string text = Fixed(value, decimals);
  return value > 0 && text.find_first_not_of("0.") != std::string::npos ? "+" + text : text;
}

std::string Grouped(std::int64_t count) {
  std::string digits = std::to_string(count);
  const std::size_t first = count < 0 ? 1 : 0;
  for (std::size_t i = digits.size(); i > first + 3;) digits.insert(i -= 3, "\u00a0");
  return WithMinus(digits);
}

int DecimalsFor(std::string_view unit, const std::vector<std::optional<double>>& exact) {
  int decimals = unit == "um" ? 1 : unit == "deg" ? 3 : 4;
  for (const std::optional<double>& number : exact) {
    const auto differs = [&] {
      const double scaled = *number * std::pow(10, decimals);
      return std::abs(scaled - std::round(scaled)) > 1e-6 * std::max(1.0, std::abs(scaled));
    };
    while (number && decimals < kMostDecimals && differs()) ++decimals;
  }
  return decimals;
}

std::string UnitText(std::string_view unit) { return unit == "um" ? "\u00b5m" : Told(unit); }

std::string TimeWords(std::chrono::system_clock::time_point time) {
  const std::string text = exchange::TimeText(std::chrono::floor<std::chrono::seconds>(time));
  return text.size() < 19 ? text : text.substr(0, 10) + " " + text.substr(11, 8) + " UTC";
}

std::string Told(std::string_view text) {
  // One byte more than is kept, so that Tame sees that it was cut; of a longer text no more is looked at.
  const std::string tame = Tame(std::string(text.substr(0, kLongestText + 1)), kLongestText);
  std::string told;
  for (const char32_t code : CodePoints(tame)) {
    const std::string_view words = WordsFor(code);
    if (words.empty())
      AppendUtf8(Misleads(code) ? U'?' : code, &told);
    else
      told += words;
  }
  // Words are longer than the signs.
  if (told.size() > kLongestText) return Tame(told, kLongestText);
  return told;
}

std::string ToldOr(std::string_view text, std::string_view otherwise) {
  return text.empty() ? std::string(otherwise) : Told(text);
}

std::vector<char32_t> CodePoints(std::string_view text) {
  std::vector<char32_t> codes;
  codes.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t at) { return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u; };
    const unsigned first = byte(i);
    const std::size_t length = first < 0x80 ? 1 : first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    char32_t code = length == 1 ? first : first & (0xffu >> (length + 1));
    bool whole = first < 0x80 || first >= 0xc2;
    for (std::size_t k = 1; k < length; ++k) {
      whole = whole && (byte(i + k) & 0xc0) == 0x80;
      code = code << 6 | (byte(i + k) & 0x3f);
    }
    codes.push_back(whole && code <= 0x10ffff ? code : U'\ufffd');
    i += whole ? length : 1;
  }
  return codes;
}

void AppendUtf8(char32_t code, std::string* text) {
  const auto put = [text](char32_t byte) { text->push_back(static_cast<char>(byte)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xc0 | code >> 6);
    put(0x80 | (code & 0x3f));
  } else if (code < 0x10000) {
    put(0xe0 | code >> 12);
    put(0x80 | (code >> 6 & 0x3f));
    put(0x80 | (code & 0x3f));
  } else {
    put(0xf0 | code >> 18);
    put(0x80 | (code >> 12 & 0x3f));
    put(0x80 | (code >> 6 & 0x3f));
    put(0x80 | (code & 0x3f));
  }
}

}  // namespace sixpoint::report
