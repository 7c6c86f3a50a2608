// Numbers and foreign texts in messages.
#pragma once

#include <cstddef>
#include <string>

namespace sixpoint {

// As it was given: the shortest text that reads back to the same number; whole numbers without an exponent; NaN, inf.
std::string NumberText(double value);
// For what was computed: six significant digits.
std::string Rounded(double value);

// Text that came from outside: at most `longest` bytes (3 or more), the last three dots where it
// was cut (never within a character of UTF-8); without control characters, and without what is no UTF-8: neither database nor
// protobuf takes that.
std::string Tame(std::string text, std::size_t longest);

}  // namespace sixpoint
