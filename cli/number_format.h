// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

namespace sixpoint::cli {

// That many decimals; "-" for NaN.
std::string Fixed(double value, int decimals);
// Of a field in which 0 says that it was not determined: "-" for it.
std::string FixedOrNone(double value, int decimals);
// An uncertainty: as Fixed, but where that leaves no digit of what is not 0, with an exponent: "3.1e-09".
std::string FixedOrTiny(double value, int decimals);
// Four significant digits: "0.03333", "5060", "1.2e+12".
std::string Significant(double value);
// The shortest text that reads back as the same number; empty for NaN.
std::string ShortestNumber(double value);
std::string ShortestNumber(float value);
// 20316804 -> "20 316 804".
std::string Grouped(std::int64_t value);

}  // namespace sixpoint::cli
