// The columns of a measured surface's patches, wherever they are kept: points, normals, expanded uncertainties, stock and regions, five in this order.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reconstructions.h"

namespace sixpoint::storage {

// As SQL selects them.
#define SIXPOINT_PATCH_COLUMNS \
  "points_in_part_mm, normals_in_part, expanded_uncertainties_um, stock_um, regions::double precision[]"

inline absl::Status InsertPatches(Transaction& transaction, const char* insert, const std::string& id,
                                  const BlankPatchesRow& patches) {
  const std::vector<double> regions(patches.regions.begin(), patches.regions.end());
  Params params;
  params.Uuid(id).Reals(patches.points_in_part_mm).Reals(patches.normals_in_part);
  params.Reals(patches.expanded_uncertainties_um).Reals(patches.stock_um).Reals(regions);
  return transaction.Execute(insert, params).status();
}

// None: nothing of that id.
inline absl::StatusOr<std::optional<BlankPatchesRow>> FindPatches(Transaction& transaction, const char* select,
                                                                  const std::string& id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(select, Params().Uuid(id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  BlankPatchesRow patches{rows->Reals(0, 0), rows->Reals(0, 1), rows->Reals(0, 2), rows->Reals(0, 3), {}};
  for (const double region : rows->Reals(0, 4)) patches.regions.push_back(static_cast<std::int64_t>(region));
  return rows->Checked(std::optional<BlankPatchesRow>(std::move(patches)));
}

}  // namespace sixpoint::storage
