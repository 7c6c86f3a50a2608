// Which characters a TrueType font has.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

namespace sixpoint::report {

// Of the first 65536 characters, by the font's table of segments (cmap format 4). FAILED_PRECONDITION: no such file, or none that has one.
absl::StatusOr<std::vector<bool>> CharactersOf(const std::string& path);

}  // namespace sixpoint::report
