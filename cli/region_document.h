// A region of a surface as documents say it: a box, and where the surface looks.
#pragma once

#include "cli/document.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::cli {

// The keys that ReadRegion reads, for OnlyKeys.
inline std::vector<std::string> RegionKeys(const std::vector<std::string>& more = {}) {
  std::vector<std::string> keys = {"region", "minimum_in_part_mm", "maximum_in_part_mm", "facing_in_part",
                                   "facing_within_deg"};
  keys.insert(keys.end(), more.begin(), more.end());
  return keys;
}

template <typename Message>
void ReadRegion(const Field& region, Message* out) {
  out->set_region(region.At("region").Text());
  if (const auto corner = region.Find("minimum_in_part_mm"))
    runtime::ToProto(corner->Vector3(), out->mutable_minimum_in_part_mm());
  if (const auto corner = region.Find("maximum_in_part_mm"))
    runtime::ToProto(corner->Vector3(), out->mutable_maximum_in_part_mm());
  if (const auto facing = region.Find("facing_in_part"))
    runtime::ToProto(facing->DirectionOfAnyLength(), out->mutable_facing_in_part());
  if (const auto within = region.Find("facing_within_deg")) out->set_facing_within_deg(within->Positive(180));
}

}  // namespace sixpoint::cli
