#include "services/correction/reconstruction_messages.h"

#include <grpcpp/support/sync_stream.h>

#include <algorithm>
#include <string>

#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/shape_region_proto.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {
namespace {

constexpr std::size_t kPatchesOfMessage = 10'000;

absl::Status Fill(const storage::ReconstructionRegionRow& row, const std::string& what, v1::ReconstructedRegion* out) {
  runtime::StoredWords words(what);
  runtime::ToProto(row.applied, &words, out->mutable_region());
  out->set_area_mm2(row.area_mm2);
  out->set_seen_part(row.seen_part);
  out->set_patch_count(row.patch_count);
  if (row.least_allowance_um) out->set_least_allowance_um(*row.least_allowance_um);
  if (row.least_spare_um) out->set_least_spare_um(*row.least_spare_um);
  out->set_greatest_band_use(row.greatest_band_use);
  if (row.worst_fixed_um) out->set_worst_fixed_um(*row.worst_fixed_um);
  if (row.worst_datum_um) out->set_worst_datum_um(*row.worst_datum_um);
  return words.status();
}

absl::Status Fill(const storage::ReconstructionHoldRow& row, const storage::ReconstructionRow& of,
                  const std::string& what, v1::HoldingPlace* out) {
  const auto limit = runtime::StoredEnum<v1::ShapeLimit>(row.limit_kind, what);
  if (!limit.ok()) return limit.status();
  runtime::SetPoint(row.place_in_part_mm, out->mutable_place_in_part_mm());
  runtime::SetDirection(row.normal_in_part, out->mutable_normal_in_part());
  out->set_region(of.regions.at(static_cast<std::size_t>(row.region_index)).applied.region);
  out->set_limit(*limit);
  out->set_upper(row.upper);
  out->set_limit_mm(row.limit_mm);
  out->set_share(row.share);
  if (row.patch) out->set_patch(*row.patch);
  return absl::OkStatus();
}

void Fill(const storage::ShapeProofRow::Relaxation& row, v1::LeastRelaxation* out) {
  out->set_at_least_um(row.at_least_um);
  out->set_at_most_um(row.at_most_um);
}

void Fill(const storage::ShapeProofRow& row, v1::ShapeProof* out) {
  out->set_of_any_shape(row.of_any_shape);
  out->set_lacking_um(row.lacking_um);
  out->set_control_reach_mm(row.control_reach_mm);
  if (row.tolerance) Fill(*row.tolerance, out->mutable_tolerance());
  if (row.stock) Fill(*row.stock, out->mutable_stock());
}

void Fill(const storage::ReconstructionMethodRow& row, v1::ReconstructionMethod* out) {
  out->set_patch_mm(row.patch_mm);
  out->set_farthest_mm(row.farthest_mm);
  out->set_coarsest_spacing_mm(row.coarsest_spacing_mm);
  out->set_finest_spacing_mm(row.finest_spacing_mm);
  out->set_blend_mm(row.blend_mm);
  out->set_coverage_factor(row.coverage_factor);
}

v1::BlankPatches SomeOf(const storage::BlankPatchesRow& patches, std::size_t first) {
  v1::BlankPatches out;
  const std::size_t end = std::min(patches.stock_um.size(), first + kPatchesOfMessage);
  runtime::AddSlice(patches.points_in_part_mm, 3 * first, 3 * end, out.mutable_points_in_part_mm());
  runtime::AddSlice(patches.normals_in_part, 3 * first, 3 * end, out.mutable_normals_in_part());
  runtime::AddSlice(patches.expanded_uncertainties_um, first, end, out.mutable_expanded_uncertainties_um());
  runtime::AddSlice(patches.stock_um, first, end, out.mutable_stock_um());
  runtime::AddSlice(patches.regions, first, end, out.mutable_regions());
  return out;
}

}  // namespace

absl::StatusOr<v1::Reconstruction> ToProto(const storage::ReconstructionRow& row) {
  v1::Reconstruction out;
  const std::string what = "reconstruction " + row.reconstruction_id;
  out.set_name(runtime::NameOf("reconstructions", row.reconstruction_id));
  out.set_blade(runtime::NameOf("blades", row.blade_serial));
  out.set_registration(runtime::NameOf("registrations", row.registration_id));
  const auto method = runtime::StoredEnum<registration::v1::Method>(row.method, what);
  if (!method.ok()) return method.status();
  out.set_registration_method(*method);
  for (const std::string& scan : row.scan_ids) out.add_scans(runtime::NameOf("scans", scan));
  Fill(row.applied, out.mutable_method());
  out.set_of_part_limits(row.of_part_limits);
  const auto outcome = runtime::StoredEnum<v1::ReconstructionOutcome>(row.outcome, what);
  if (!outcome.ok()) return outcome.status();
  out.set_outcome(*outcome);
  out.set_remark(row.remark);
  for (const storage::ReconstructionRegionRow& region : row.regions)
    if (absl::Status status = Fill(region, what, out.add_regions()); !status.ok()) return status;
  for (const storage::ReconstructionHoldRow& hold : row.holds)
    if (absl::Status status = Fill(hold, row, what, out.add_holding()); !status.ok()) return status;
  if (row.proof) Fill(*row.proof, out.mutable_proof());
  if (row.worst_step_um) out.set_worst_step_um(*row.worst_step_um);
  if (row.worst_kink_deg) out.set_worst_kink_deg(*row.worst_kink_deg);
  out.mutable_points()->set_taken(row.taken_count);
  out.mutable_points()->set_far_off(row.far_off_count);
  out.mutable_points()->set_shapeless(row.shapeless_count);
  out.set_patch_count(row.patch_count);
  out.set_spacing_mm(row.spacing_mm);
  out.set_control_count(row.control_count);
  out.set_level_count(row.level_count);
  out.set_pass_count(row.pass_count);
  out.set_patches_sha256(row.patches_sha256);
  out.set_lattice_sha256(row.lattice_sha256);
  out.set_requested_by(row.requested_by);
  out.set_software_version(row.software_version);
  out.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, out.mutable_recorded_at());
  out.set_record_sequence(row.recorded.sequence);
  out.set_work_order(row.work_order);
  out.set_operation(row.operation);
  return out;
}

void LeaveBasic(v1::Reconstruction* reconstruction) { reconstruction->clear_holding(); }

absl::Status Write(const storage::BlankPatchesRow& patches, grpc::ServerWriter<v1::BlankPatches>* writer) {
  for (std::size_t first = 0; first < patches.stock_um.size(); first += kPatchesOfMessage)
    if (!writer->Write(SomeOf(patches, first))) return absl::CancelledError("patches: the client went away");
  return absl::OkStatus();
}

v1::ReconstructRequest RequestOf(const v1::Reconstruction& recorded) {
  v1::ReconstructRequest request;
  request.set_registration(recorded.registration());
  *request.mutable_method() = recorded.method();
  for (const v1::ReconstructedRegion& region : recorded.regions()) {
    const plant::v1::ShapeRegion& applied = region.region();
    if (!applied.has_allowance_mm() && !applied.has_lower_mm() && !applied.has_upper_mm()) continue;
    v1::TriedLimits& tried = *request.add_tried_limits();
    tried.set_region(applied.region());
    if (applied.has_allowance_mm()) tried.set_allowance_mm(applied.allowance_mm());
    if (applied.has_lower_mm()) tried.set_lower_mm(applied.lower_mm());
    if (applied.has_upper_mm()) tried.set_upper_mm(applied.upper_mm());
  }
  return request;
}

}  // namespace sixpoint::correction
