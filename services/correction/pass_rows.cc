#include "services/correction/pass_rows.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "services/clients/registered_row.h"
#include "services/correction/reconstruction_rows.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"
#include "storage/blobs.h"

namespace sixpoint::correction {
namespace {

std::string WordOf(metrology::PassOutcome outcome) {
  switch (outcome) {
    case metrology::PassOutcome::kDone:
      return "DONE";
    case metrology::PassOutcome::kAnotherPass:
      return "ANOTHER_PASS";
    case metrology::PassOutcome::kScrap:
      return "SCRAP";
    case metrology::PassOutcome::kNotDetermined:
      return "NOT_DETERMINED";
  }
  return "NOT_DETERMINED";
}

storage::MachinedRegionRow MachinedRegionRowOf(const std::string& region, const metrology::PassRegion& found) {
  storage::MachinedRegionRow row;
  row.region = region;
  row.patch_count = static_cast<int>(found.patch_count);
  row.seen_part = found.seen_part;
  row.mean_rest_um = runtime::In_um(found.mean_rest_mm);
  row.least_rest_um = runtime::In_um(found.least_rest_mm);
  row.greatest_rest_um = runtime::In_um(found.greatest_rest_mm);
  row.least_lower_spare_um = runtime::In_um(found.least_lower_spare_mm);
  row.least_upper_spare_um = runtime::In_um(found.least_upper_spare_mm);
  row.offset_um = runtime::In_um(found.offset_mm);
  row.deflection_share = found.deflection_share;
  return row;
}

void Fill(const storage::MachinedRegionRow& row, v1::MachinedRegion* out) {
  out->set_region(row.region);
  out->set_patch_count(row.patch_count);
  out->set_seen_part(row.seen_part);
  if (row.mean_rest_um) out->set_mean_rest_um(*row.mean_rest_um);
  if (row.least_rest_um) out->set_least_rest_um(*row.least_rest_um);
  if (row.greatest_rest_um) out->set_greatest_rest_um(*row.greatest_rest_um);
  if (row.least_lower_spare_um) out->set_least_lower_spare_um(*row.least_lower_spare_um);
  if (row.least_upper_spare_um) out->set_least_upper_spare_um(*row.least_upper_spare_um);
  if (row.offset_um) out->set_offset_um(*row.offset_um);
  if (row.deflection_share) out->set_deflection_share(*row.deflection_share);
}

}  // namespace

runtime::Made<storage::MachiningPassRow> RecordOf(const clients::RegisteredBlade& blade,
                                                  const storage::CorrectionRow& correction, int number,
                                                  const Shape& shape, const LeftByPass& left) {
  storage::MachiningPassRow row;
  row.pass_id = storage::NewUuid();
  clients::SetRegistered(blade.registration, &row);
  row.correction_id = correction.correction_id;
  row.reconstruction_id = correction.reconstruction_id;
  row.number = number;
  row.outcome = WordOf(left.judged.outcome);
  row.remark = left.judged.remark;
  row.taken_count = left.counts.taken;
  row.far_off_count = left.counts.far_off;
  row.shapeless_count = left.counts.shapeless;
  row.patch_count = static_cast<int>(left.patches.size());
  for (std::size_t i = 0; i < shape.regions.size(); ++i)
    row.regions.push_back(MachinedRegionRowOf(shape.regions[i].name, left.judged.regions.at(i)));
  row.patches = PatchesRowOf(left.patches, left.rest_mm, left.region_of);
  row.patches_sha256 = DigestOf(row.patches);
  storage::RecordEntry entry = clients::EntryOf(
      "machining_pass", runtime::NameOf("machining_passes", row.pass_id), blade.registration,
      {runtime::NameOf("corrections", row.correction_id), runtime::NameOf("reconstructions", row.reconstruction_id)});
  entry.summary_json = nlohmann::json{{"outcome", row.outcome}, {"number", row.number}}.dump();
  return {std::move(row), std::move(entry)};
}

absl::StatusOr<v1::MachiningPass> ToProto(const storage::MachiningPassRow& row) {
  v1::MachiningPass out;
  const std::string what = "machining pass " + row.pass_id;
  out.set_name(runtime::NameOf("machining_passes", row.pass_id));
  out.set_blade(runtime::NameOf("blades", row.blade_serial));
  out.set_correction(runtime::NameOf("corrections", row.correction_id));
  out.set_reconstruction(runtime::NameOf("reconstructions", row.reconstruction_id));
  out.set_number(row.number);
  out.set_registration(runtime::NameOf("registrations", row.registration_id));
  const auto method = runtime::StoredEnum<registration::v1::Method>(row.method, what);
  if (!method.ok()) return method.status();
  out.set_registration_method(*method);
  for (const std::string& scan : row.scan_ids) out.add_scans(runtime::NameOf("scans", scan));
  const auto outcome = runtime::StoredEnum<v1::MachiningPassOutcome>(row.outcome, what);
  if (!outcome.ok()) return outcome.status();
  out.set_outcome(*outcome);
  out.set_remark(row.remark);
  for (const storage::MachinedRegionRow& region : row.regions) Fill(region, out.add_regions());
  out.mutable_points()->set_taken(row.taken_count);
  out.mutable_points()->set_far_off(row.far_off_count);
  out.mutable_points()->set_shapeless(row.shapeless_count);
  out.set_patch_count(row.patch_count);
  out.set_patches_sha256(row.patches_sha256);
  out.set_requested_by(row.requested_by);
  out.set_software_version(row.software_version);
  out.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, out.mutable_recorded_at());
  out.set_record_sequence(row.recorded.sequence);
  out.set_work_order(row.work_order);
  out.set_operation(row.operation);
  if (row.greatest_rest_mm) out.set_greatest_rest_mm(*row.greatest_rest_mm);
  return out;
}

void LeaveBasic(v1::MachiningPass* pass) { pass->clear_regions(); }

}  // namespace sixpoint::correction
