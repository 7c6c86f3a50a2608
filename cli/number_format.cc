#include "cli/number_format.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace sixpoint::cli {
namespace {

template <typename Number>
std::string Shortest(Number value) {
  if (std::isnan(value)) return "";
  char buffer[32];
  const auto written = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, written.ptr);
}

}  // namespace

std::string Fixed(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  // -0.000 would read as a direction that is not there.
  if (std::strtod(text, nullptr) == 0 && text[0] == '-') return text + 1;
  return text;
}

std::string FixedOrNone(double value, int decimals) { return value == 0 ? "-" : Fixed(value, decimals); }

std::string FixedOrTiny(double value, int decimals) {
  const std::string text = Fixed(value, decimals);
  if (value == 0 || text.find_first_of("123456789") != std::string::npos || text == "-") return text;
  char tiny[40];
  std::snprintf(tiny, sizeof tiny, "%.1e", value);
  return tiny;
}

std::string Significant(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string ShortestNumber(double value) { return Shortest(value); }
std::string ShortestNumber(float value) { return Shortest(value); }

std::string Grouped(std::int64_t value) {
  std::string digits = std::to_string(value);
  const std::size_t first = digits[0] == '-' ? 1 : 0;
  for (std::size_t i = digits.size(); i > first + 3;) {
    i -= 3;
    digits.insert(i, " ");
  }
  return digits;
}

}  // namespace sixpoint::cli
