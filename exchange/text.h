// Numbers, times and texts, as the formats of this folder share them.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace sixpoint::exchange {

// Without an exponent, as xs:decimal and K-fields have it: the shortest that reads back as the same number, for |value| < 1e15. What is so
// small that this would take more than 24 digits (below about 1e-7) is rounded at 1e-22: validators read no more.
std::string DecimalText(double value);
// A whole finite number, blanks around it allowed; else none.
std::optional<double> NumberOf(std::string_view text);
std::optional<int> WholeNumberOf(std::string_view text);

// RFC 3339, UTC, with as many digits of a second as it has: "2026-11-21T03:25:01.5Z".
std::string TimeText(std::chrono::system_clock::time_point time);
// With a zone or Z; without one it is UTC. Years 1970 to 2200.
std::optional<std::chrono::system_clock::time_point> TimeOf(std::string_view text);
// AQDEF's "21.11.2026/03:25:01", UTC. Of older files the time may be cut after the day, or after the minute.
std::string DottedTimeText(std::chrono::system_clock::time_point time);
std::optional<std::chrono::system_clock::time_point> DottedTimeOf(std::string_view text);

std::string_view Trimmed(std::string_view text);
// UTF-8 that XML may hold, and no control characters beside tab and ends of line.
bool IsPlainText(std::string_view text);
// The UUID's 36 characters at the end of "inspections/UUID"; none where there is none.
std::optional<std::string> UuidOf(std::string_view resource_name);

}  // namespace sixpoint::exchange
