#include "services/plant/validate_shape_regions.h"

#include <set>
#include <string>

#include "services/plant/drawing_checks.h"
#include "services/plant/surface_where.h"
#include "services/runtime/contract_words.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;

constexpr double kGreatest_mm = 5;

// Wanted of some kinds, and of no other.
absl::Status ReadWithin(const std::string& field, bool wanted, bool has, double value, double least,
                        std::optional<double>* out) {
  const std::string range = NumberText(least) + " to " + NumberText(kGreatest_mm) + " mm";
  if (wanted && !has) return Refuse(field, "not stated", range);
  if (!wanted && has) return Refuse(field, value, "none, for a region of this kind");
  if (!has) return absl::OkStatus();
  *out = value;
  return CheckRange(field, value, least, kGreatest_mm, range);
}

absl::Status ReadRegion(const std::string& at, const v1::ShapeRegion& in, std::set<std::string>* called,
                        storage::ShapeRegionRow* row) {
  runtime::Refusals refusals;
  row->region = in.region();
  refusals.Add(CheckCalled(at + ".region", in.region(), called)).Add(ReadWhere(at, in, row));
  if (in.rest() && IsBounded(in)) refusals.Add(Refuse(at + ".rest", "true", "neither box nor facing with it"));
  if (!in.rest() && !IsBounded(in))
    refusals.Add(Refuse(at, "not bounded", "a corner of its box, facing_in_part, or rest"));
  refusals.Add(runtime::ReadWord(at + ".kind", in.kind(), &row->kind));
  if (row->kind.empty()) return refusals.status();
  const bool has_band = in.kind() != v1::SHAPE_REGION_KIND_DATUM;
  refusals
      .Add(ReadWithin(at + ".allowance_mm", in.kind() == v1::SHAPE_REGION_KIND_MACHINED, in.has_allowance_mm(),
                      in.allowance_mm(), 0, &row->allowance_mm))
      .Add(ReadWithin(at + ".lower_mm", has_band, in.has_lower_mm(), in.lower_mm(), -kGreatest_mm, &row->lower_mm))
      .Add(ReadWithin(at + ".upper_mm", has_band, in.has_upper_mm(), in.upper_mm(), -kGreatest_mm, &row->upper_mm));
  if (row->lower_mm && row->upper_mm && !(*row->lower_mm < *row->upper_mm))
    refusals.Add(Refuse(at + ".lower_mm", *row->lower_mm, "less than upper_mm, " + NumberText(*row->upper_mm)));
  return refusals.status();
}

}  // namespace

absl::Status ReadShapeRegions(const v1::Part& part, std::vector<storage::ShapeRegionRow>* rows) {
  runtime::Refusals refusals;
  std::set<std::string> called;
  int rests = 0, machined = 0;
  for (int i = 0; i < part.shape_regions_size(); ++i) {
    const v1::ShapeRegion& region = part.shape_regions(i);
    refusals.Add(ReadRegion("part.shape_regions[" + std::to_string(i) + "]", region, &called, &rows->emplace_back()));
    rests += region.rest();
    machined += region.kind() == v1::SHAPE_REGION_KIND_MACHINED;
  }
  if (rests > 1) refusals.Add(Refuse("part.shape_regions", std::to_string(rests) + " with the rest", "one at most"));
  if (part.shape_regions_size() > 0 && machined == 0)
    refusals.Add(Refuse("part.shape_regions", "none machined", "at least one: what is not cut is not reconstructed"));
  return refusals.status();
}

}  // namespace sixpoint::plant
