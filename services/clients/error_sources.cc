#include "services/clients/error_sources.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::clients {
namespace {

constexpr int kMostDraws = 64;
constexpr double kLeast_um = 1e-6;  // less is nothing, and no number that is kept as a real

// To six digits, which a real gives back as they were: what is answered now is what is read later.
double AsKept(double um) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", um);
  return std::strtod(text, nullptr);
}

// Where the arm stood when it calibrated, on the mean of its series, and when it scanned: independent draws of one estimate, which share its
// degrees of freedom by what each does, so that together they have what the study has.
void AddArm(const std::string& machine, const std::string& series, const FetchedSensorCalibration& sensor,
            const metrology::ArmSpread& spread, std::vector<metrology::ErrorSource>* sources) {
  std::vector<metrology::ArmShare> swings = sensor.arm_shares;
  if (swings.empty()) swings.push_back({sensor.arm_series, metrology::Matrix6d::Identity()});
  std::string name = "arm when calibrated, " + sensor.name;
  metrology::Matrix6d calibrated = metrology::Matrix6d::Zero(), scanned = metrology::Matrix6d::Identity();
  double of_calibrated = 0;
  for (const metrology::ArmShare& swing : swings) {
    if (!series.empty() && swing.arm_series == series) {  // the scan was taken where the arm stood then
      scanned -= swing.response;
      if (!sensor.arm_shares.empty()) name += ", without " + series;
      continue;
    }
    calibrated += swing.response * spread.covariance * swing.response.transpose();
    of_calibrated += swing.response.diagonal().squaredNorm();
  }
  const double of_scanned = scanned.diagonal().squaredNorm(), both = of_calibrated + of_scanned;
  if (of_calibrated > 0)
    sources->push_back(metrology::ArmSwing(name, calibrated, of_calibrated / both * spread.degrees_of_freedom));
  if (of_scanned > 0)
    sources->push_back(metrology::ArmSwing("arm when scanned, " + machine + ", " + series,
                                           scanned * spread.covariance * scanned.transpose(),
                                           of_scanned / both * spread.degrees_of_freedom));
}

}  // namespace

bool IsFormOfBlade(const std::string& source) { return source.rfind("form, ", 0) == 0; }

metrology::ScannerField FieldOf(const plant::v1::Sensor& sensor) {
  const auto of = sensor.kind() == plant::v1::SENSOR_KIND_SNAPSHOT ? &metrology::ScannerField::OfSnapshot
                                                                   : &metrology::ScannerField::Of;
  return of(sensor.mid_range_mm(), sensor.range_mm(), sensor.line_angle_deg() * runtime::kRadPerDeg);
}

metrology::Travel ApproachOf(const plant::v1::Machine& machine) {
  switch (machine.error_sources().approach()) {
    case plant::v1::APPROACH_UPWARDS:
      return metrology::Travel::kForward;
    case plant::v1::APPROACH_DOWNWARDS:
      return metrology::Travel::kBackward;
    default:
      return metrology::Travel::kUnknown;
  }
}

absl::StatusOr<metrology::Stretch> StretchOf(const Scanned& scanned) {
  const plant::v1::ErrorSources& stated = scanned.machine.error_sources();
  const ingest::v1::ScanHeader& scan = scanned.scan;
  const auto coefficient = [](const plant::v1::ThermalExpansion& in) {
    return metrology::ExpansionCoefficient{1e-6 * in.um_per_m_k(), 1e-6 * in.standard_uncertainty_um_per_m_k()};
  };
  std::optional<metrology::ExpansionCoefficient> scales;
  if (stated.has_scale_expansion()) scales = coefficient(stated.scale_expansion());
  if (!scan.has_subject_temperature_c()) {
    if (!stated.has_temperature_half_range_k() || !scanned.part.has_thermal_expansion()) return metrology::Stretch();
    const metrology::Temperature anywhere = metrology::Within(stated.temperature_half_range_k());
    return metrology::StretchOf(coefficient(scanned.part.thermal_expansion()), anywhere, scales, anywhere);
  }
  const std::string as = ", as scans/" + scan.scan_id() + " states a temperature";
  if (!scanned.part.has_thermal_expansion())
    return runtime::Refuse(scanned.part.name() + ".thermal_expansion", "not given", "the material's" + as);
  if (!stated.has_temperature_k())
    return runtime::Refuse(scanned.machine.name() + ".error_sources.temperature_k", "not given",
                           "the thermometer's standard uncertainty" + as);
  if (scales && scan.cloud() == ingest::v1::CLOUD_KIND_SNAPSHOT)
    return runtime::Refuse("scans/" + scan.scan_id() + ".subject_temperature_c",
                           NumberText(scan.subject_temperature_c()),
                           "none: a snapshot is not as long as the scales of " + scanned.machine.name() +
                               " have it, whose scale_expansion is stated");
  if (scales && !scan.has_scales_temperature_c())
    return runtime::Refuse("scans/" + scan.scan_id() + ".scales_temperature_c", "not given",
                           "one beside subject_temperature_c: " + scanned.machine.name() + " has scale_expansion");
  return metrology::StretchOf(coefficient(scanned.part.thermal_expansion()),
                              {scan.subject_temperature_c(), stated.temperature_k()}, scales,
                              metrology::Temperature{scan.scales_temperature_c(), stated.temperature_k()});
}

absl::StatusOr<std::vector<metrology::ErrorSource>> FurtherSources(const Scanned& scanned,
                                                                   const FetchedSensorCalibration& sensor,
                                                                   const FetchedRotationCalibration& rotation,
                                                                   const std::optional<FetchedArmStudy>& arm) {
  const std::string& machine = scanned.machine.name();
  const plant::v1::ErrorSources& stated = scanned.machine.error_sources();
  constexpr double kPerM = 1e-6;  // of um in a m
  std::vector<metrology::ErrorSource> sources;
  if (stated.has_touch_offset_um())
    sources.push_back(
        metrology::TouchOffset(1e-3 * stated.touch_offset_um(), rotation.axes.a.direction, rotation.axes.b.direction));
  if (stated.has_scanner_field_um() || sensor.sensor.measured_field)
    sources.push_back(metrology::ScannerFieldSource(
        metrology::FieldCovarianceOf(1e-3 * stated.scanner_field_um(), sensor.sensor.measured_field),
        sensor.sensor.field_response));
  if (stated.has_linear_scale_um_per_m())
    sources.push_back(metrology::ScalesOfLinearAxes(kPerM * stated.linear_scale_um_per_m(), rotation.linear_response));
  if (stated.has_squareness_um_per_m())
    sources.push_back(
        metrology::SquarenessOfLinearAxes(kPerM * stated.squareness_um_per_m(), rotation.linear_response));
  const absl::StatusOr<metrology::Stretch> stretch = StretchOf(scanned);
  if (!stretch.ok()) return stretch.status();
  if (stretch->by_temperatures > 0)
    sources.push_back(metrology::Expansion("temperature", stretch->by_temperatures, rotation.linear_response));
  for (metrology::ErrorSource& source : sources) source.name += ", " + machine;
  if (stretch->by_coefficients > 0)
    sources.push_back(metrology::Expansion("expansion, " + scanned.part.name() + " on " + machine,
                                           stretch->by_coefficients, rotation.linear_response));
  const ingest::v1::ScanTravel travel = scanned.scan.travel();
  const bool known = travel != ingest::v1::SCAN_TRAVEL_UNSPECIFIED && sensor.travel != travel &&
                     sensor.travel != ingest::v1::SCAN_TRAVEL_UNSPECIFIED;
  if (known && !stated.has_encoder_latency_um())
    return runtime::Refuse("scans/" + scanned.scan.scan_id() + ".travel", ingest::v1::ScanTravel_Name(travel),
                           ingest::v1::ScanTravel_Name(sensor.travel) + ", as " + sensor.name +
                               " was made, or encoder_latency_um in the error_sources of " + machine);
  if (known)
    sources.push_back(metrology::EncoderLatency("encoder's latency, " + machine, 1e-3 * stated.encoder_latency_um()));
  if (arm.has_value()) AddArm(machine, scanned.scan.arm_series(), sensor, arm->spread, &sources);
  return sources;
}

void ToProto(const metrology::ErrorSource& source, uncertainty::v1::ErrorSource* out) {
  out->set_name(source.name);
  if (std::isfinite(source.degrees_of_freedom)) out->set_degrees_of_freedom(source.degrees_of_freedom);
  for (const auto& [matrix, to] :
       {std::pair<Eigen::MatrixXd, geometry::v1::Matrix*>(source.parameters_per_sigma,
                                                          out->mutable_parameters_per_sigma()),
        std::pair<Eigen::MatrixXd, geometry::v1::Matrix*>(source.pose_per_sigma, out->mutable_pose_per_sigma())})
    runtime::SetMatrix(runtime::RowMajor(matrix), static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()), to);
}

absl::StatusOr<std::vector<metrology::ErrorSource>> FromProto(
    const std::string& field, const google::protobuf::RepeatedPtrField<uncertainty::v1::ErrorSource>& in) {
  std::vector<metrology::ErrorSource> sources;
  for (const uncertainty::v1::ErrorSource& one : in) {
    const std::string of = field + "[" + one.name() + "]";
    const auto parameters = runtime::FromProto(of + ".parameters_per_sigma", one.parameters_per_sigma());
    if (!parameters.ok()) return parameters.status();
    const auto pose = runtime::FromProto(of + ".pose_per_sigma", one.pose_per_sigma());
    if (!pose.ok()) return pose.status();
    const Eigen::Index rows = parameters->rows();
    if ((rows != metrology::kCalibrationParameterCount && rows != metrology::kFirstLinearParameter) ||
        pose->rows() != 6 || parameters->cols() != pose->cols() || pose->cols() > kMostDraws)
      return runtime::Refuse(of,
                             std::to_string(parameters->rows()) + " x " + std::to_string(parameters->cols()) + " and " +
                                 std::to_string(pose->rows()) + " x " + std::to_string(pose->cols()),
                             std::to_string(metrology::kCalibrationParameterCount) + " and 6 rows, as many draws");
    metrology::ErrorSource& source = sources.emplace_back();
    source.name = one.name();
    if (one.has_degrees_of_freedom()) source.degrees_of_freedom = one.degrees_of_freedom();
    if (!(source.degrees_of_freedom > 0))
      return runtime::Refuse(of + ".degrees_of_freedom", std::to_string(source.degrees_of_freedom), "more than 0");
    source.parameters_per_sigma.setZero(metrology::kCalibrationParameterCount, parameters->cols());
    source.parameters_per_sigma.topRows(rows) =
        *parameters;  // without the linear axes in those from before they were named
    source.pose_per_sigma = *pose;
  }
  return sources;
}

KeptBudgets Kept(const std::vector<const std::vector<metrology::UncertaintyComponent>*>& components_um2) {
  KeptBudgets kept;
  const auto um_of = [](const metrology::UncertaintyComponent& one) { return AsKept(std::sqrt(one.variance)); };
  for (const auto* const components : components_um2)
    for (const metrology::UncertaintyComponent& one : *components)
      if (um_of(one) >= kLeast_um &&
          std::find(kept.sources.begin(), kept.sources.end(), one.source) == kept.sources.end())
        kept.sources.push_back(one.source);
  for (const auto* const components : components_um2) {
    std::vector<double>& um = kept.standard_uncertainties_um.emplace_back(kept.sources.size());
    for (const metrology::UncertaintyComponent& one : *components) {
      const auto found = std::find(kept.sources.begin(), kept.sources.end(), one.source);
      if (um_of(one) >= kLeast_um) um[static_cast<std::size_t>(found - kept.sources.begin())] = um_of(one);
    }
  }
  return kept;
}

absl::StatusOr<std::vector<uncertainty::v1::UncertaintyComponent>> BudgetOf(const std::string& result,
                                                                            const std::vector<std::string>& sources,
                                                                            const std::vector<double>& um) {
  std::vector<uncertainty::v1::UncertaintyComponent> budget;
  if (um.empty()) return budget;
  if (um.size() != sources.size()) return absl::DataLossError(result + ": a budget of another size than its sources");
  double variance = 0;
  for (std::size_t i = 0; i < um.size(); ++i) {
    if (!(um[i] > 0)) continue;
    uncertainty::v1::UncertaintyComponent& one = budget.emplace_back();
    one.set_source(sources[i]);
    one.set_standard_uncertainty_um(um[i]);
    variance += um[i] * um[i];
  }
  for (uncertainty::v1::UncertaintyComponent& one : budget)
    if (variance > 0) one.set_share(std::pow(one.standard_uncertainty_um(), 2) / variance);
  std::stable_sort(budget.begin(), budget.end(), [](const auto& one, const auto& other) {
    return one.standard_uncertainty_um() > other.standard_uncertainty_um();
  });
  return budget;
}

}  // namespace sixpoint::clients
