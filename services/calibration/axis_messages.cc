#include "services/calibration/axis_messages.h"

#include <algorithm>
#include <cmath>

#include "services/calibration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {
namespace {

using runtime::Refuse;
constexpr double kRadPerDeg = M_PI / 180;
constexpr int kMostReadings = 200'000;

storage::AngleEstimateRow Degrees(const metrology::Estimate& estimate) {
  return {estimate.value / kRadPerDeg, estimate.standard_uncertainty / kRadPerDeg};
}

std::vector<double> Scaled(const std::vector<double>& values, double factor) {
  std::vector<double> scaled;
  for (const double value : values) scaled.push_back(value * factor);
  return scaled;
}

void SetEstimate(const storage::AngleEstimateRow& in, v1::AngleEstimate* out) {
  out->set_value_deg(in.value_deg);
  out->set_standard_uncertainty_deg(in.standard_uncertainty_deg);
}

void SetPeriodic(int order, const storage::AngleEstimateRow& amplitude, v1::PeriodicError* out) {
  out->set_period_deg(360.0 / order);
  SetEstimate(amplitude, out->mutable_amplitude());
}

}  // namespace

metrology::Travel TravelFrom(v1::Travel travel) {
  switch (travel) {
    case v1::TRAVEL_FORWARD:
      return metrology::Travel::kForward;
    case v1::TRAVEL_BACKWARD:
      return metrology::Travel::kBackward;
    default:
      return metrology::Travel::kUnknown;
  }
}

absl::Status CheckAxisRequest(const v1::CharacteriseAxisRequest& request) {
  if (absl::Status s = CheckCaller(request.machine(), request.requested_by(), request.request_id()); !s.ok()) return s;
  if (request.axis().empty()) return Refuse("axis", "", "the letter of a rotary axis");
  return runtime::CheckId("axis", request.axis());
}

absl::StatusOr<std::vector<metrology::AxisReading>> ReadingsOf(const v1::AxisRun& run) {
  const int count = run.commanded_deg_size();
  if (count < 1 || count > kMostReadings)
    return Refuse("run.commanded_deg", std::to_string(count) + " values", "1 to " + std::to_string(kMostReadings));
  if (run.measured_deg_size() != count)
    return Refuse("run.measured_deg", std::to_string(run.measured_deg_size()) + " values",
                  std::to_string(count) + ", one for each command");
  if (run.travel_size() != 0 && run.travel_size() != count)
    return Refuse("run.travel", std::to_string(run.travel_size()) + " values",
                  "none or " + std::to_string(count) + ", one for each command");
  std::vector<double> commanded_rad;
  for (int i = 0; i < count; ++i) {
    const std::string at = "[" + std::to_string(i) + "]";
    if (!std::isfinite(run.commanded_deg(i))) return Refuse("run.commanded_deg" + at, run.commanded_deg(i), "a number");
    if (!std::isfinite(run.measured_deg(i))) return Refuse("run.measured_deg" + at, run.measured_deg(i), "a number");
    if (run.travel_size() != 0 && run.travel(i) != v1::TRAVEL_FORWARD && run.travel(i) != v1::TRAVEL_BACKWARD)
      return Refuse("run.travel" + at, std::to_string(run.travel(i)), "TRAVEL_FORWARD or TRAVEL_BACKWARD");
    commanded_rad.push_back(run.commanded_deg(i) * kRadPerDeg);
  }
  std::vector<metrology::Travel> travel;
  if (run.travel_size() == 0) {
    const auto derived = metrology::TravelOf(commanded_rad);
    if (!derived.ok()) return Refuse("run.commanded_deg", "all the same", "a turn and back");
    travel = *derived;
  }
  std::vector<metrology::AxisReading> readings;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<size_t>(i);
    readings.push_back(
        {commanded_rad[k], run.measured_deg(i) * kRadPerDeg, travel.empty() ? TravelFrom(run.travel(i)) : travel[k]});
  }
  return readings;
}

absl::StatusOr<metrology::Joint> JointOf(const std::string& machine, const metrology::JointChain& chain,
                                         const std::string& axis) {
  std::string rotary;
  for (const metrology::Joint& joint : chain.joints()) {
    if (joint.motion.kind != metrology::JointKind::kRotary) continue;
    if (joint.axis == axis) return joint;
    rotary += (rotary.empty() ? "" : ", ") + joint.axis;
  }
  return Refuse("axis", axis, "a rotary axis of " + machine + ": " + (rotary.empty() ? "it has none" : rotary));
}

int BeyondLimits(const v1::AxisRun& run, const metrology::Joint& joint) {
  // Limits come from degrees: what is at a limit is within it.
  constexpr double kRounding = 1e-12;
  return static_cast<int>(std::count_if(run.commanded_deg().begin(), run.commanded_deg().end(), [&](double deg) {
    return deg * kRadPerDeg < joint.minimum - kRounding || deg * kRadPerDeg > joint.maximum + kRounding;
  }));
}

storage::AxisCharacterisationRow RowOf(const metrology::AxisCharacterisation& result, const std::string& axis) {
  storage::AxisCharacterisationRow row;
  row.axis = axis;
  row.reading_count = result.reading_count;
  row.reversal = Degrees(result.reversal_rad);
  row.mean = Degrees(result.mean_rad);
  row.long_wave_order = result.long_wave.order;
  row.long_wave_amplitude = Degrees(result.long_wave.amplitude_rad);
  if (result.periodic) {
    row.periodic_order = result.periodic->order;
    row.periodic_amplitude = Degrees(result.periodic->amplitude_rad);
  }
  row.least_detectable_deg = result.least_detectable_rad / kRadPerDeg;
  row.greatest_error = Degrees(result.greatest_error_rad);
  row.greatest_error_at_deg = result.greatest_error_at_rad / kRadPerDeg;
  row.greatest_error_forward = result.greatest_error_travel == metrology::Travel::kForward;
  row.standard_uncertainty = Degrees(result.standard_uncertainty_rad);
  row.compensated_standard_uncertainty = Degrees(result.compensated_standard_uncertainty_rad);
  row.noise = Degrees(result.noise_rad);
  row.forward_error_deg = Scaled(result.table.forward_rad, 1 / kRadPerDeg);
  row.backward_error_deg = Scaled(result.table.backward_rad, 1 / kRadPerDeg);
  row.table_standard_uncertainty_deg = result.table_standard_uncertainty_rad / kRadPerDeg;
  return row;
}

v1::AxisCharacterisation ToProto(const storage::AxisCharacterisationRow& row) {
  v1::AxisCharacterisation out;
  out.set_axis(row.axis);
  out.set_reading_count(row.reading_count);
  if (row.beyond_limits_count) out.set_beyond_limits_count(*row.beyond_limits_count);
  SetEstimate(row.reversal, out.mutable_reversal());
  SetEstimate(row.mean, out.mutable_mean());
  SetPeriodic(row.long_wave_order, row.long_wave_amplitude, out.mutable_long_wave());
  if (row.periodic_order) SetPeriodic(*row.periodic_order, row.periodic_amplitude, out.mutable_periodic());
  out.set_least_detectable_deg(row.least_detectable_deg);
  SetEstimate(row.greatest_error, out.mutable_greatest_error());
  out.set_greatest_error_at_deg(row.greatest_error_at_deg);
  out.set_greatest_error_travel(row.greatest_error_forward ? v1::TRAVEL_FORWARD : v1::TRAVEL_BACKWARD);
  SetEstimate(row.standard_uncertainty, out.mutable_standard_uncertainty());
  SetEstimate(row.compensated_standard_uncertainty, out.mutable_compensated_standard_uncertainty());
  SetEstimate(row.noise, out.mutable_noise());
  v1::AngleErrorTable* table = out.mutable_table();
  table->set_standard_uncertainty_deg(row.table_standard_uncertainty_deg);
  if (row.forward_error_deg.empty()) return out;
  table->set_step_deg(360.0 / static_cast<double>(row.forward_error_deg.size()));
  table->mutable_forward_error_deg()->Add(row.forward_error_deg.begin(), row.forward_error_deg.end());
  table->mutable_backward_error_deg()->Add(row.backward_error_deg.begin(), row.backward_error_deg.end());
  return out;
}

metrology::AngleTable TableOf(const storage::AxisCharacterisationRow& row) {
  return {Scaled(row.forward_error_deg, kRadPerDeg), Scaled(row.backward_error_deg, kRadPerDeg)};
}

}  // namespace sixpoint::calibration
