#include "services/ingest/raw_profiles.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

namespace sixpoint::ingest {
namespace {

absl::Status Wrong(std::size_t profile, const std::string& what) {
  return absl::InvalidArgumentError("profile " + std::to_string(profile) + ": " + what);
}

// Every platform of ours is little-endian.
template <typename Number>
Number Take(std::string_view* payload) {
  Number number;
  std::memcpy(&number, payload->data(), sizeof number);
  payload->remove_prefix(sizeof number);
  return number;
}

}  // namespace

absl::StatusOr<RawProfiles> ParseRawProfiles(std::string_view payload, int columns_per_profile, double raw_step_mm,
                                             int point_count) {
  const auto columns = static_cast<std::size_t>(columns_per_profile);
  const std::size_t mask_bytes = (columns + 7) / 8;
  const auto wanted = static_cast<std::size_t>(point_count);
  RawProfiles profiles;
  profiles.points_mm.reserve(wanted);
  profiles.columns.reserve(wanted);
  for (std::size_t profile = 0; !payload.empty(); ++profile) {
    if (payload.size() < sizeof(double) + mask_bytes) return Wrong(profile, "the payload ends inside its head");
    const double x_mm = Take<double>(&payload);
    if (!std::isfinite(x_mm)) return Wrong(profile, "x is not finite");
    const std::string_view mask = payload.substr(0, mask_bytes);
    payload.remove_prefix(mask_bytes);
    for (std::size_t column = 0; column < 8 * mask_bytes; ++column) {
      if ((static_cast<unsigned char>(mask[column / 8]) >> (column % 8) & 1) == 0) continue;
      if (column >= columns) return Wrong(profile, "a mask bit is set beyond column " + std::to_string(columns - 1));
      if (payload.size() < 2 * sizeof(std::int32_t)) return Wrong(profile, "the payload ends inside its points");
      if (profiles.points_mm.size() == wanted) return Wrong(profile, "more points than the block's point_count");
      const auto y = Take<std::int32_t>(&payload);
      const auto z = Take<std::int32_t>(&payload);
      profiles.points_mm.emplace_back(x_mm, y * raw_step_mm, z * raw_step_mm);
      profiles.columns.push_back(static_cast<int>(column));
    }
  }
  if (profiles.points_mm.size() != wanted) {
    return absl::InvalidArgumentError(std::to_string(profiles.points_mm.size()) +
                                      " points, fewer than the block's point_count");
  }
  return profiles;
}

}  // namespace sixpoint::ingest
