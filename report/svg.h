// Drawings as inline SVG.
#pragma once

#include <absl/status/status.h>

#include <string>
#include <string_view>

#include "report/drawing.h"

namespace sixpoint::report {

// Of HTML and of attributes in double quotes.
std::string Escaped(std::string_view text);

// Appends an <svg> element that is as wide as drawn, or as the place it stands in; `alt` is its name to who does not see it.
absl::Status AppendSvg(const Drawing& drawing, std::string_view alt, std::string* html);

}  // namespace sixpoint::report
