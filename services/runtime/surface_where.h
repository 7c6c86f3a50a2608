// Where on a surface a region is, as rows keep it: a box and where the surface looks, each numbers in lists, empty where not bounded so.
#pragma once

#include <optional>

#include "services/runtime/row_geometry.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::runtime {

template <typename Row, typename Message>
void SetWhere(const Row& row, Message* to) {
  if (!row.minimum_in_part_mm.empty()) SetPoint(row.minimum_in_part_mm, to->mutable_minimum_in_part_mm());
  if (!row.maximum_in_part_mm.empty()) SetPoint(row.maximum_in_part_mm, to->mutable_maximum_in_part_mm());
  if (!row.facing_in_part.empty()) SetDirection(row.facing_in_part, to->mutable_facing_in_part());
  if (row.facing_within_deg) to->set_facing_within_deg(*row.facing_within_deg);
}

// As kernels take it (metrology::SurfaceRegion).
template <typename Region, typename Row>
Region WhereOf(const Row& row) {
  Region region;
  region.minimum_mm = VectorOf(row.minimum_in_part_mm);
  region.maximum_mm = VectorOf(row.maximum_in_part_mm);
  region.facing = VectorOf(row.facing_in_part);
  if (row.facing_within_deg) region.facing_within_rad = kRadPerDeg * *row.facing_within_deg;
  return region;
}

}  // namespace sixpoint::runtime
