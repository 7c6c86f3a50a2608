#include "services/runtime/shape_region_proto.h"

#include "services/runtime/surface_where.h"

namespace sixpoint::runtime {

void ToProto(const storage::ShapeRegionRow& row, StoredWords* words, plant::v1::ShapeRegion* region) {
  region->set_region(row.region);
  SetWhere(row, region);
  region->set_rest(row.minimum_in_part_mm.empty() && row.maximum_in_part_mm.empty() && row.facing_in_part.empty());
  region->set_kind(words->Value<plant::v1::ShapeRegionKind>(row.kind));
  if (row.allowance_mm) region->set_allowance_mm(*row.allowance_mm);
  if (row.lower_mm) region->set_lower_mm(*row.lower_mm);
  if (row.upper_mm) region->set_upper_mm(*row.upper_mm);
}

}  // namespace sixpoint::runtime
