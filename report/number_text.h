// Numbers, times and texts as a page shows them.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sixpoint::report {

inline constexpr std::string_view kNotMeasuredText = "not measured", kNotGiven = "not given";

// With so many decimals and a minus of its own; never "-0.0".
std::string Fixed(double value, int decimals);
// As many digits as it has, at most six.
std::string Shortest(double value);
// "+0.012", for differences.
std::string Signed(double value, int decimals);
std::string Grouped(std::int64_t count);  // 12 345 678

// Of values in this unit: mm 4, um 1, deg 3, else 4; more, up to 6, where one of these numbers would be told as another.
int DecimalsFor(std::string_view unit, const std::vector<std::optional<double>>& exact);
// "µm" of um; others as they are.
std::string UnitText(std::string_view unit);

// "2026-11-21 03:25:01 UTC".
std::string TimeWords(std::chrono::system_clock::time_point time);

// A text from outside as a page can show it: UTF-8, at most kLongestText bytes, the last three dots where it was cut; "?" for what is no UTF-8,
// for controls, and for marks that change the direction or the place of what stands beside them; signs of tolerances that fonts lack in words.
inline constexpr std::size_t kLongestText = 240;
std::string Told(std::string_view text);
// kNotGiven where it is empty.
std::string ToldOr(std::string_view text, std::string_view otherwise = kNotGiven);

// The code points of a text that Told made; U+FFFD for what is none.
std::vector<char32_t> CodePoints(std::string_view text);
void AppendUtf8(char32_t code, std::string* text);

}  // namespace sixpoint::report
