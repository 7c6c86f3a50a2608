// The columns of a shape region, wherever it is kept: its name, box, facing, kind and limits, nine in this order.
#pragma once

#include "storage/optional_reals.h"
#include "storage/plant_registry.h"

namespace sixpoint::storage {

inline void AddShapeRegion(const ShapeRegionRow& region, Params* params) {
  params->Text(region.region);
  for (const auto* const values : {&region.minimum_in_part_mm, &region.maximum_in_part_mm, &region.facing_in_part})
    AddOptionalReals(*values, params);
  params->OptionalReal(region.facing_within_deg).Text(region.kind).OptionalReal(region.allowance_mm);
  params->OptionalReal(region.lower_mm).OptionalReal(region.upper_mm);
}

// From that column on.
inline ShapeRegionRow ShapeRegionAt(const Rows& rows, int row, int column) {
  return {rows.Text(row, column),
          OptionalRealsAt(rows, row, column + 1),
          OptionalRealsAt(rows, row, column + 2),
          OptionalRealsAt(rows, row, column + 3),
          rows.OptionalReal(row, column + 4),
          rows.Text(row, column + 5),
          rows.OptionalReal(row, column + 6),
          rows.OptionalReal(row, column + 7),
          rows.OptionalReal(row, column + 8)};
}

}  // namespace sixpoint::storage
