#include "report/pdf_text.h"

#include <algorithm>

#include "report/number_text.h"

namespace sixpoint::report {
namespace {

bool FromTheRight(char32_t c) {
  const bool digit = (c >= 0x660 && c <= 0x669) || (c >= 0x6f0 && c <= 0x6f9);
  return !digit && ((c >= 0x590 && c <= 0x8ff) || (c >= 0xfb1d && c <= 0xfdff) || (c >= 0xfe70 && c <= 0xfeff));
}

}  // namespace

std::vector<char32_t> Shown(const std::string& text, const std::vector<bool>& has) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::vector<char32_t> shown;
  for (const char32_t code : CodePoints(text)) {
    if (code < has.size() && has[code]) {
      shown.push_back(code);
      continue;
    }
    for (const char c : {'[', 'U', '+'}) shown.push_back(static_cast<char32_t>(c));
    for (int shift = code > 0xffff ? 20 : 12; shift >= 0; shift -= 4)
      shown.push_back(static_cast<char32_t>(kDigits[code >> shift & 15]));
    shown.push_back(U']');
  }
  return shown;
}

std::vector<char32_t> InOrderOfSight(std::vector<char32_t> codes) {
  for (auto begin = codes.begin(); begin != codes.end();) {
    if (!FromTheRight(*begin)) {
      ++begin;
      continue;
    }
    // Blanks between such letters belong to the run, those behind it do not.
    auto end = begin + 1;
    for (auto next = end; next != codes.end() && (FromTheRight(*next) || *next == U' '); ++next)
      if (*next != U' ') end = next + 1;
    std::reverse(begin, end);
    begin = end;
  }
  return codes;
}

}  // namespace sixpoint::report
