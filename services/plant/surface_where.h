// Where on a surface a region is, as drawings and parts say it: by a box and by where the surface looks.
#pragma once

#include <absl/status/status.h>

#include <algorithm>
#include <string>

#include "services/plant/checks.h"

namespace sixpoint::plant {

inline constexpr double kUsualFacing_deg = 60;

// A message or row that has no bound at all is the caller's to refuse.
template <typename Message>
bool IsBounded(const Message& in) {
  return in.has_minimum_in_part_mm() || in.has_maximum_in_part_mm() || in.has_facing_in_part();
}

template <typename Message, typename Row>
absl::Status ReadWhere(const std::string& at, const Message& in, Row* row) {
  runtime::Refusals refusals;
  auto &low = row->minimum_in_part_mm, &high = row->maximum_in_part_mm;
  if (in.has_minimum_in_part_mm()) refusals.Add(Read(at + ".minimum_in_part_mm", true, in.minimum_in_part_mm(), &low));
  if (in.has_maximum_in_part_mm()) refusals.Add(Read(at + ".maximum_in_part_mm", true, in.maximum_in_part_mm(), &high));
  for (std::size_t k = 0; k < std::min(low.size(), high.size()); ++k)
    if (!(low[k] < high[k]))
      refusals.Add(runtime::Refuse(at + ".maximum_in_part_mm." + "xyz"[k] + "_mm", high[k],
                                   "above minimum_in_part_mm, " + NumberText(low[k])));
  if (in.has_facing_in_part()) {
    refusals.Add(Read(at + ".facing_in_part", true, in.facing_in_part(), &row->facing_in_part));
    row->facing_within_deg = in.has_facing_within_deg() ? in.facing_within_deg() : kUsualFacing_deg;
    refusals.Add(CheckPositive(at + ".facing_within_deg", *row->facing_within_deg, 180));
  } else if (in.has_facing_within_deg()) {
    refusals.Add(runtime::Refuse(at + ".facing_within_deg", in.facing_within_deg(), "facing_in_part with it"));
  }
  return refusals.status();
}

}  // namespace sixpoint::plant
