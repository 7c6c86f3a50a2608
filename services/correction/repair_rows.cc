#include "services/correction/repair_rows.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "services/clients/registered_row.h"
#include "services/runtime/little_endian.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/time_proto.h"
#include "storage/blobs.h"

namespace sixpoint::correction {
namespace {

using runtime::Short;

constexpr std::size_t kMostRemarkBytes = 1000;

storage::RepairSectionRow LeftOutRow(double z_mm, const absl::Status& why) {
  storage::RepairSectionRow row;
  row.z_mm = z_mm;
  row.kind = "LEFT_OUT";
  row.remark = std::string(why.message().substr(0, kMostRemarkBytes));
  if (row.remark.empty()) row.remark = "not measured";
  return row;
}

storage::RepairSectionRow TargetRow(const metrology::TargetSection& section, const std::vector<double>& rest_mm) {
  storage::RepairSectionRow row;
  row.z_mm = section.z_mm;
  row.kind = "TARGET";
  double sum_um = 0, most_um = 0;
  for (const double standard_mm : section.standard_mm) {
    const double expanded_um = 1e3 * metrology::kTargetCoverage * standard_mm;
    sum_um += expanded_um;
    most_um = std::max(most_um, expanded_um);
  }
  row.mean_expanded_uncertainty_um = sum_um / static_cast<double>(section.standard_mm.size());
  row.greatest_expanded_uncertainty_um = most_um;
  const auto [least, most] = std::minmax_element(rest_mm.begin(), rest_mm.end());
  row.greatest_rest_um = 1e3 * *most;
  row.deepest_cut_um = std::max(0.0, -1e3 * *least);
  return row;
}

std::vector<storage::RepairSectionRow> SectionRowsOf(const metrology::RepairPlan& plan) {
  const auto& beside_none = plan.target.left_out;  // by their place among the measured
  std::vector<storage::RepairSectionRow> rows;
  for (std::size_t k = 0; k < plan.measured.sections.size(); ++k) {
    const auto found = std::find_if(beside_none.begin(), beside_none.end(),
                                    [k](const metrology::LeftOutSection& one) { return one.index == k; });
    const double z_mm = plan.measured.sections[k].z_mm;
    if (found != beside_none.end()) {
      rows.push_back(LeftOutRow(z_mm, found->refusal));
    } else {
      rows.emplace_back().z_mm = z_mm;
      rows.back().kind = "MEASURED";
    }
  }
  for (const metrology::LeftOutSection& one : plan.measured.left_out) rows.push_back(LeftOutRow(one.z_mm, one.refusal));
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.z_mm < b.z_mm; });
  for (std::size_t k = 0; k < plan.target.sections.size(); ++k)
    rows.push_back(TargetRow(plan.target.sections[k], plan.removal.rest_mm[k]));
  return rows;
}

storage::RepairContourRow ContourRowOf(const metrology::TargetSection& section, const Eigen::Vector2d& origin_mm,
                                       const std::vector<double>& rest_mm) {
  storage::RepairContourRow row;
  const auto& nodes = section.outline.nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Eigen::Vector2d point = nodes[i].point_mm + origin_mm;
    row.points_in_part_mm.insert(row.points_in_part_mm.end(), {point.x(), point.y(), section.z_mm});
    row.expanded_uncertainties_um.push_back(Short(1e3 * metrology::kTargetCoverage * section.standard_mm[i]));
    row.rest_um.push_back(Short(1e3 * rest_mm[i]));
  }
  return row;
}

storage::RepairLapRow LapRowOf(const metrology::RecontourPass& lap) {
  storage::RepairLapRow row;
  row.z_mm = lap.z_mm;
  row.allowance_mm = lap.allowance_mm;
  for (const metrology::ToolPlace& place : lap.places)
    for (int i = 0; i < 3; ++i) {
      row.centres_in_part_mm.push_back(place.centre_mm[i]);
      row.axes_in_part.push_back(place.axis[i]);
    }
  return row;
}

std::string DigestOf(const std::vector<storage::RepairContourRow>& contours) {
  std::string bytes;
  for (const storage::RepairContourRow& contour : contours) {
    runtime::AppendReals(contour.points_in_part_mm, &bytes);
    runtime::AppendFloats(contour.expanded_uncertainties_um, &bytes);
    runtime::AppendFloats(contour.rest_um, &bytes);
  }
  return storage::Sha256Hex(bytes);
}

std::string DigestOf(const std::vector<storage::RepairLapRow>& laps) {
  std::string bytes;
  for (const storage::RepairLapRow& lap : laps) {
    runtime::AppendReals({lap.z_mm, lap.allowance_mm}, &bytes);
    runtime::AppendReals(lap.centres_in_part_mm, &bytes);
    runtime::AppendReals(lap.axes_in_part, &bytes);
  }
  return storage::Sha256Hex(bytes);
}

void SetPath(const metrology::RepairPlan& plan, storage::RepairRow* row) {
  row->greatest_stock_mm = plan.stock_mm;
  row->step_over_mm = plan.step_over_mm;
  row->roughing_layer_count = static_cast<int>(plan.path.roughing_layers);
  row->lap_count = static_cast<int>(plan.path.passes.size());
  double lifted_mm = 0;
  for (const metrology::RecontourPass& lap : plan.path.passes) {
    row->place_count += static_cast<int>(lap.places.size());
    row->path_length_mm += metrology::Length_mm(lap.places);
    for (const metrology::ToolPlace& place : lap.places) lifted_mm = std::max(lifted_mm, place.lifted_mm);
    row->laps.push_back(LapRowOf(lap));
  }
  row->greatest_lift_um = 1e3 * lifted_mm;
  row->path_sha256 = DigestOf(row->laps);
}

void Fill(const storage::RepairMethodRow& row, v1::Repair* out) {
  v1::RepairHeights& heights = *out->mutable_heights();
  heights.set_first_mm(row.first_mm);
  heights.set_repair_line_mm(row.repair_line_mm);
  heights.set_target_mm(row.target_mm);
  heights.set_line_width_mm(row.line_width_mm);
  out->mutable_mill()->set_diameter_mm(row.mill_diameter_mm);
  out->mutable_mill()->set_length_mm(row.mill_length_mm);
  v1::RepairMethod& method = *out->mutable_method();
  method.set_cornered_edges(row.cornered_edges);
  if (row.leading_in_part_mm.size() == 3) {
    geometry::v1::Point& leading = *method.mutable_leading_in_part_mm();
    leading.set_x_mm(row.leading_in_part_mm[0]);
    leading.set_y_mm(row.leading_in_part_mm[1]);
    leading.set_z_mm(row.leading_in_part_mm[2]);
  }
  method.set_farthest_mm(row.farthest_mm);
  method.set_scallop_um(row.scallop_um);
  method.set_lead_deg(row.lead_deg);
  method.set_tilt_deg(row.tilt_deg);
  method.set_depth_of_cut_mm(row.depth_of_cut_mm);
  method.set_finish_allowance_mm(row.finish_allowance_mm);
  method.set_roughing_step_mm(row.roughing_step_mm);
  method.set_guard_um(row.guard_um);
  method.set_chord_um(row.chord_um);
  method.set_greatest_turn_deg(row.greatest_turn_deg);
  method.set_greatest_uncertainty_um(row.greatest_uncertainty_um);
}

absl::Status Fill(const storage::RepairSectionRow& row, const std::string& what, v1::RepairSection* out) {
  out->set_z_mm(row.z_mm);
  const auto kind = runtime::StoredEnum<v1::RepairSectionKind>(row.kind, what);
  if (!kind.ok()) return kind.status();
  out->set_kind(*kind);
  out->set_remark(row.remark);
  if (row.mean_expanded_uncertainty_um) out->set_mean_expanded_uncertainty_um(*row.mean_expanded_uncertainty_um);
  if (row.greatest_expanded_uncertainty_um)
    out->set_greatest_expanded_uncertainty_um(*row.greatest_expanded_uncertainty_um);
  if (row.greatest_rest_um) out->set_greatest_rest_um(*row.greatest_rest_um);
  if (row.deepest_cut_um) out->set_deepest_cut_um(*row.deepest_cut_um);
  return absl::OkStatus();
}

void FillFound(const storage::RepairRow& row, v1::Repair* out) {
  if (row.determination) {
    v1::RepairDetermination& determination = *out->mutable_determination();
    determination.set_camber(row.determination->camber);
    determination.set_thickness(row.determination->thickness);
    determination.set_leading(row.determination->leading);
    determination.set_trailing(row.determination->trailing);
  }
  out->mutable_points()->set_below_line(row.below_line_count);
  out->mutable_points()->set_above_line(row.above_line_count);
  out->mutable_points()->set_left_out(row.left_out_count);
  out->set_greatest_stock_mm(row.greatest_stock_mm);
  out->set_step_over_mm(row.step_over_mm);
  out->set_roughing_layer_count(row.roughing_layer_count);
  out->set_lap_count(row.lap_count);
  out->set_place_count(row.place_count);
  out->set_path_length_mm(row.path_length_mm);
  out->set_greatest_lift_um(row.greatest_lift_um);
  v1::RepairRemoval& removal = *out->mutable_removal();
  removal.set_place_count_below_line(row.removal.place_count_below_line);
  removal.set_deepest_below_line_um(row.removal.deepest_below_line_um);
  removal.set_deepest_in_target_um(row.removal.deepest_in_target_um);
  removal.set_deepest_beyond_uncertainty_um(row.removal.deepest_beyond_uncertainty_um);
  removal.set_greatest_rest_um(row.removal.greatest_rest_um);
  removal.set_mean_rest_um(row.removal.mean_rest_um);
  out->set_contours_sha256(row.contours_sha256);
  out->set_path_sha256(row.path_sha256);
}

}  // namespace

runtime::Made<storage::RepairRow> RecordOf(const clients::RegisteredBlade& blade,
                                           const storage::RepairMethodRow& method, const PlannedRepair& planned) {
  const metrology::RepairPlan& plan = planned.plan;
  storage::RepairRow row;
  row.repair_id = storage::NewUuid();
  clients::SetRegistered(blade.registration, &row);
  row.applied = method;
  if (const auto& found = plan.target.determination; found.has_value())
    row.determination = {found->camber, found->thickness, found->leading, found->trailing};
  row.below_line_count = planned.counts.below_line;
  row.above_line_count = planned.counts.above_line;
  row.left_out_count = planned.counts.left_out;
  SetPath(plan, &row);
  const metrology::SimulatedRemoval& removal = plan.removal;
  row.removal = {
      static_cast<int>(removal.place_count_below), 1e3 * removal.deepest_below_mm, 1e3 * removal.deepest_in_target_mm,
      1e3 * removal.deepest_beyond_uncertainty_mm, 1e3 * removal.greatest_rest_mm, 1e3 * removal.mean_rest_mm};
  row.sections = SectionRowsOf(plan);
  for (std::size_t k = 0; k < plan.target.sections.size(); ++k)
    row.contours.push_back(ContourRowOf(plan.target.sections[k], plan.origin_mm, removal.rest_mm[k]));
  row.contours_sha256 = DigestOf(row.contours);
  storage::RecordEntry entry =
      clients::EntryOf("repair", runtime::NameOf("repairs", row.repair_id), blade.registration);
  entry.summary_json = nlohmann::json{{"repair_line_mm", method.repair_line_mm}, {"lap_count", row.lap_count}}.dump();
  return {std::move(row), std::move(entry)};
}

absl::StatusOr<v1::Repair> ToProto(const storage::RepairRow& row) {
  v1::Repair out;
  const std::string what = "repair " + row.repair_id;
  out.set_name(runtime::NameOf("repairs", row.repair_id));
  out.set_blade(runtime::NameOf("blades", row.blade_serial));
  out.set_registration(runtime::NameOf("registrations", row.registration_id));
  const auto method = runtime::StoredEnum<registration::v1::Method>(row.method, what);
  if (!method.ok()) return method.status();
  out.set_registration_method(*method);
  for (const std::string& scan : row.scan_ids) out.add_scans(runtime::NameOf("scans", scan));
  Fill(row.applied, &out);
  const auto extrapolation = runtime::StoredEnum<v1::RepairExtrapolation>(row.applied.extrapolation, what);
  if (!extrapolation.ok()) return extrapolation.status();
  out.mutable_method()->set_extrapolation(*extrapolation);
  for (const storage::RepairSectionRow& section : row.sections)
    if (absl::Status status = Fill(section, what, out.add_sections()); !status.ok()) return status;
  FillFound(row, &out);
  out.set_requested_by(row.requested_by);
  out.set_software_version(row.software_version);
  out.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, out.mutable_recorded_at());
  out.set_record_sequence(row.recorded.sequence);
  out.set_work_order(row.work_order);
  out.set_operation(row.operation);
  return out;
}

void LeaveBasic(v1::Repair* repair) { repair->clear_sections(); }

absl::Status Write(const std::vector<storage::RepairContourRow>& contours,
                   grpc::ServerWriter<v1::TargetContour>* writer) {
  for (const storage::RepairContourRow& contour : contours) {
    v1::TargetContour out;
    runtime::AddSlice(contour.points_in_part_mm, 0, contour.points_in_part_mm.size(), out.mutable_points_in_part_mm());
    runtime::AddSlice(contour.expanded_uncertainties_um, 0, contour.expanded_uncertainties_um.size(),
                      out.mutable_expanded_uncertainties_um());
    runtime::AddSlice(contour.rest_um, 0, contour.rest_um.size(), out.mutable_rest_um());
    if (!writer->Write(out)) return absl::CancelledError("contours: the client went away");
  }
  return absl::OkStatus();
}

absl::Status Write(const std::vector<storage::RepairLapRow>& laps, grpc::ServerWriter<v1::RepairLap>* writer) {
  for (const storage::RepairLapRow& lap : laps) {
    v1::RepairLap out;
    out.set_z_mm(lap.z_mm);
    out.set_allowance_mm(lap.allowance_mm);
    runtime::AddSlice(lap.centres_in_part_mm, 0, lap.centres_in_part_mm.size(), out.mutable_centres_in_part_mm());
    runtime::AddSlice(lap.axes_in_part, 0, lap.axes_in_part.size(), out.mutable_axes_in_part());
    if (!writer->Write(out)) return absl::CancelledError("path: the client went away");
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::correction
