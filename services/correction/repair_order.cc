#include "services/correction/repair_order.h"

#include <algorithm>
#include <string>

#include "refusal/message_text.h"
#include "services/correction/applied_value.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::correction {
namespace {

constexpr double kHalfWidth_mm = 0.25;  // of the points of a section, which slide along the CAD into its plane

void ReadHeights(const v1::PlanRepairRequest& request, storage::RepairMethodRow* method, runtime::Refusals* refusals) {
  if (!request.has_heights()) refusals->Add(runtime::Refuse("heights", "unset", "first, repair line and target"));
  const v1::RepairHeights& heights = request.heights();
  method->first_mm = heights.first_mm();
  method->repair_line_mm = heights.repair_line_mm();
  method->target_mm = heights.target_mm();
  method->line_width_mm = heights.has_line_width_mm() ? heights.line_width_mm() : 1;
  if (!(method->line_width_mm >= 0.1 && method->line_width_mm <= 10))
    refusals->Add(runtime::Refuse("heights.line_width_mm", method->line_width_mm, "0.1 to 10"));
}

void ReadMill(const v1::PlanRepairRequest& request, storage::RepairMethodRow* method, runtime::Refusals* refusals) {
  if (!request.has_mill()) refusals->Add(runtime::Refuse("mill", "unset", "diameter and length"));
  const auto read = [&](const char* field, double value, double least, double most) {
    if (request.has_mill() && !(value >= least && value <= most))
      refusals->Add(runtime::Refuse(field, value, NumberText(least) + " to " + NumberText(most)));
    return value;
  };
  method->mill_diameter_mm = read("mill.diameter_mm", request.mill().diameter_mm(), 0.5, 20);
  method->mill_length_mm = read("mill.length_mm", request.mill().length_mm(), 1, 300);
}

std::string ExtrapolationWord(v1::RepairExtrapolation asked, runtime::Refusals* refusals) {
  if (asked == v1::REPAIR_EXTRAPOLATION_UNSPECIFIED) asked = v1::REPAIR_EXTRAPOLATION_PROCESS_OF_DEVIATION;
  std::string word;
  refusals->Add(runtime::ReadWord("method.extrapolation", asked, &word));
  return word;
}

metrology::ExtrapolationMethod ExtrapolationOf(const std::string& word) {
  if (word == "POLYNOMIAL") return metrology::ExtrapolationMethod::kPolynomial;
  if (word == "POLYNOMIAL_OF_DEVIATION") return metrology::ExtrapolationMethod::kPolynomialOfDeviation;
  return metrology::ExtrapolationMethod::kProcessOfDeviation;
}

}  // namespace

absl::StatusOr<storage::RepairMethodRow> RepairMethodOf(const v1::PlanRepairRequest& request) {
  storage::RepairMethodRow method;
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("registration", "registrations", request.registration()).status());
  ReadHeights(request, &method, &refusals);
  ReadMill(request, &method, &refusals);
  const v1::RepairMethod& asked = request.method();
  method.extrapolation = ExtrapolationWord(asked.extrapolation(), &refusals);
  method.cornered_edges = asked.cornered_edges();
  if (asked.has_leading_in_part_mm()) {
    const auto leading = runtime::FromProto("method.leading_in_part_mm", asked.leading_in_part_mm());
    refusals.Add(leading.status());
    if (leading.ok()) method.leading_in_part_mm = runtime::ListOf(*leading);
  }
  const auto read = [&](const char* name, bool is_stated, double value, double usual, double least, double most) {
    return AppliedValue(name, is_stated, value, usual, least, most, &refusals);
  };
  method.farthest_mm = read("farthest_mm", asked.has_farthest_mm(), asked.farthest_mm(), 5, 0.5, 20);
  method.scallop_um = read("scallop_um", asked.has_scallop_um(), asked.scallop_um(), 5, 0.5, 200);
  method.lead_deg = read("lead_deg", asked.has_lead_deg(), asked.lead_deg(), 0, -75, 75);
  method.tilt_deg = read("tilt_deg", asked.has_tilt_deg(), asked.tilt_deg(), 50, -75, 75);
  method.depth_of_cut_mm = read("depth_of_cut_mm", asked.has_depth_of_cut_mm(), asked.depth_of_cut_mm(), 0.5, 0.02, 10);
  method.finish_allowance_mm =
      read("finish_allowance_mm", asked.has_finish_allowance_mm(), asked.finish_allowance_mm(), 0.1, 0.005, 5);
  method.roughing_step_mm =
      read("roughing_step_mm", asked.has_roughing_step_mm(), asked.roughing_step_mm(), 1, 0.05, 10);
  method.guard_um = read("guard_um", asked.has_guard_um(), asked.guard_um(), 10, 0, 500);
  method.chord_um = read("chord_um", asked.has_chord_um(), asked.chord_um(), 1, 0.1, 20);
  method.greatest_turn_deg =
      read("greatest_turn_deg", asked.has_greatest_turn_deg(), asked.greatest_turn_deg(), 1.2, 0.1, 10);
  method.greatest_uncertainty_um = read("greatest_uncertainty_um", asked.has_greatest_uncertainty_um(),
                                        asked.greatest_uncertainty_um(), 50, 1, 5000);
  if (!refusals.status().ok()) return refusals.status();
  return method;
}

metrology::RepairOptions RepairOptionsOf(const storage::RepairMethodRow& method, const metrology::Surface& surface,
                                         int threads, const runtime::Caller& caller) {
  metrology::RepairOptions options;
  metrology::StackOptions& stack = options.stack;
  stack.heights = {method.first_mm, method.repair_line_mm, method.target_mm, method.line_width_mm};
  stack.origin_mm = ((surface.minimum_mm() + surface.maximum_mm()) / 2).head<2>();
  if (const auto leading = runtime::VectorOf(method.leading_in_part_mm)) stack.leading_mm = leading->head<2>();
  stack.half_width_mm = std::min(kHalfWidth_mm, method.line_width_mm / 2);
  stack.noise_um = 0;  // what the residuals show
  stack.round_ends = !method.cornered_edges;
  stack.surface = &surface;
  stack.thread_count = threads;
  options.extrapolation = ExtrapolationOf(method.extrapolation);
  options.scallop_mm = 1e-3 * method.scallop_um;
  options.guard_mm = 1e-3 * method.guard_um;
  options.chord_mm = 1e-3 * method.chord_um;
  options.greatest_uncertainty_mm = 1e-3 * method.greatest_uncertainty_um;
  options.greatest_turn_rad = method.greatest_turn_deg * runtime::kRadPerDeg;
  metrology::PathOptions& path = options.path;
  path.mill = {method.mill_diameter_mm / 2, method.mill_length_mm};
  path.lead_rad = method.lead_deg * runtime::kRadPerDeg;
  path.tilt_rad = method.tilt_deg * runtime::kRadPerDeg;
  path.depth_of_cut_mm = method.depth_of_cut_mm;
  path.finish_allowance_mm = method.finish_allowance_mm;
  path.roughing_step_mm = method.roughing_step_mm;
  options.keep_going = caller.keep_going;
  return options;
}

v1::PlanRepairRequest RequestOf(const v1::Repair& recorded) {
  v1::PlanRepairRequest request;
  request.set_registration(recorded.registration());
  *request.mutable_heights() = recorded.heights();
  *request.mutable_mill() = recorded.mill();
  *request.mutable_method() = recorded.method();
  return request;
}

}  // namespace sixpoint::correction
