#include "services/calibration/trend.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>

#include "metrology/kinematics/rotary_axes.h"
#include "metrology/statistics/standard_deviation.h"
#include "metrology/studies/drift.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::calibration {
namespace {

constexpr double kSecondsPerDay = 86400;
constexpr double kUsualCoverage = 3;

// How far an axis leans toward a direction across it, with what the covariance says of it.
CalibratedParameter Lean(const std::string& name, const std::vector<double>& direction, int toward,
                         const std::vector<double>& covariance, int first) {
  const Eigen::Vector3d d(direction.at(0), direction.at(1), direction.at(2));
  Eigen::Matrix2d block;
  for (int r = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c) block(r, c) = covariance.at(8 * (first + r) + first + c);
  const Eigen::RowVector2d row = metrology::TangentBasis(d).row(toward);
  const double variance = (row * block * row.transpose())(0);
  return {name, runtime::kDegPerRad * std::asin(std::clamp(d(toward), -1.0, 1.0)),
          runtime::kDegPerRad * metrology::StandardDeviation(variance)};
}

std::vector<CalibratedParameter> SensorParameters(const storage::SensorCalibrationRow& s) {
  const auto sigma = [&](int k) { return std::sqrt(s.covariance.at(7 * k)); };
  return {{"alpha_deg", s.alpha_deg, s.alpha_standard_uncertainty_deg},
          {"beta_deg", s.beta_deg, s.beta_standard_uncertainty_deg},
          {"gamma_deg", s.gamma_deg, s.gamma_standard_uncertainty_deg},
          {"t_sm_x_mm", s.t_sm_mm.at(0), sigma(3)},
          {"t_sm_y_mm", s.t_sm_mm.at(1), sigma(4)},
          {"t_sm_z_mm", s.t_sm_mm.at(2), sigma(5)}};
}

std::vector<CalibratedParameter> RotationParameters(const storage::RotationCalibrationRow& r) {
  return {{"point_c_x_mm", r.point_c_mm.at(0), r.point_c_standard_uncertainty_mm.at(0)},
          {"point_c_y_mm", r.point_c_mm.at(1), r.point_c_standard_uncertainty_mm.at(1)},
          {"point_c_z_mm", r.point_c_mm.at(2), r.point_c_standard_uncertainty_mm.at(2)},
          Lean("a_toward_x_deg", r.a_direction, 0, r.covariance, 0),
          Lean("a_toward_z_deg", r.a_direction, 2, r.covariance, 0),
          Lean("b_toward_y_deg", r.b_direction, 1, r.covariance, 4),
          Lean("b_toward_z_deg", r.b_direction, 2, r.covariance, 4)};
}

std::vector<CalibratedParameter> ProbeParameters(const storage::ProbeCalibrationRow& p) {
  const auto sigma = [&](int k) { return std::sqrt(p.covariance.at(7 * k)); };
  return {{"approach_x", p.approach.at(0), sigma(0)},      {"approach_y", p.approach.at(1), sigma(1)},
          {"approach_z", p.approach.at(2), sigma(2)},      {"offset_x_mm", p.offset_mm.at(0), sigma(3)},
          {"offset_y_mm", p.offset_mm.at(1), sigma(4)},    {"offset_z_mm", p.offset_mm.at(2), sigma(5)},
          {"scale", p.scale, p.scale_standard_uncertainty}};
}

std::vector<CalibratedParameter> AxisParameters(const storage::AxisCharacterisationRow& a) {
  const auto parameter = [](const std::string& name, const storage::AngleEstimateRow& estimate) {
    return CalibratedParameter{name, estimate.value_deg, estimate.standard_uncertainty_deg};
  };
  // Where no periodic error stands out of the noise, its uncertainty is 0 and the run is no part of its trend.
  return {parameter("reversal_deg", a.reversal), parameter("mean_deg", a.mean),
          parameter("long_wave_amplitude_deg", a.long_wave_amplitude),
          parameter("periodic_amplitude_deg", a.periodic_order ? a.periodic_amplitude : storage::AngleEstimateRow()),
          parameter("greatest_error_deg", a.greatest_error)};
}

struct Series {
  std::vector<metrology::DatedEstimate> estimates;
  std::vector<const storage::CalibrationRow*> rows;
};

absl::Status CheckNames(const v1::GetCalibrationTrendRequest& request, const std::vector<CalibratedParameter>& known) {
  std::string names;
  for (const CalibratedParameter& p : known) names += (names.empty() ? "" : ", ") + p.name;
  const auto is_known = [&](const std::string& name) {
    return std::any_of(known.begin(), known.end(), [&](const CalibratedParameter& p) { return p.name == name; });
  };
  for (int i = 0; i < request.parameters_size(); ++i)
    if (!is_known(request.parameters(i)))
      return runtime::Refuse("parameters[" + std::to_string(i) + "]", request.parameters(i), "one of " + names);
  for (int i = 0; i < request.limits_size(); ++i) {
    const std::string field = "limits[" + std::to_string(i) + "]";
    if (!is_known(request.limits(i).parameter()))
      return runtime::Refuse(field + ".parameter", request.limits(i).parameter(), "one of " + names);
    if (!std::isfinite(request.limits(i).limit()) || request.limits(i).limit() <= 0)
      return runtime::Refuse(field + ".limit", request.limits(i).limit(), "> 0");
  }
  return absl::OkStatus();
}

// By parameter.
std::map<std::string, Series> SeriesOf(const std::vector<storage::CalibrationRow>& history) {
  std::map<std::string, Series> all;
  for (const storage::CalibrationRow& row : history)
    for (const CalibratedParameter& p : ParametersOf(row)) {
      // The paper's methods leave a parameter as the record has it and say nothing of its uncertainty; nor is there one of
      // what was not found.
      if (!(p.standard_uncertainty > 0)) continue;
      const double days =
          std::chrono::duration<double>(row.valid_from - history.front().valid_from).count() / kSecondsPerDay;
      all[p.name].estimates.push_back({days, p.value, p.standard_uncertainty});
      all[p.name].rows.push_back(&row);
    }
  return all;
}

absl::StatusOr<v1::ParameterTrend> TrendOfParameter(const std::string& name, const Series& series,
                                                    const metrology::DriftOptions& options) {
  v1::ParameterTrend trend;
  trend.set_parameter(name);
  const absl::StatusOr<metrology::Drift> drift = metrology::AssessDrift(series.estimates, options);
  if (!drift.ok()) return drift.status();
  for (std::size_t i = 0; i < series.rows.size(); ++i) {
    v1::TrendPoint* point = trend.add_points();
    point->set_calibration(series.rows[i]->name());
    runtime::ToProto(series.rows[i]->valid_from, point->mutable_valid_from());
    point->set_value(series.estimates[i].value);
    point->set_standard_uncertainty(series.estimates[i].standard_uncertainty);
    if (series.rows[i]->environment.temperature_c) point->set_temperature_c(*series.rows[i]->environment.temperature_c);
    if (i == 0) continue;
    const metrology::DriftStep& step = drift->steps[i - 1];
    point->set_change(step.change);
    point->set_change_ratio(step.ratio);
    point->set_alarm(step.step_alarm || step.limit_alarm);
  }
  if (drift->line) {
    trend.set_slope_per_day(drift->line->slope_per_day);
    trend.set_slope_standard_uncertainty_per_day(drift->line->slope_standard_uncertainty_per_day);
    trend.set_slope_t(drift->line->t);
    trend.set_slope_t_limit(drift->line->t_limit);
    trend.set_scatter_ratio(drift->line->scatter_ratio);
  }
  if (drift->step_alarm) trend.add_alarms("STEP");
  if (drift->trend_alarm) trend.add_alarms("TREND");
  if (drift->limit_alarm) trend.add_alarms("LIMIT");
  return trend;
}

}  // namespace

std::vector<CalibratedParameter> ParametersOf(const storage::CalibrationRow& row) {
  if (row.sensor) return SensorParameters(*row.sensor);
  if (row.rotation) return RotationParameters(*row.rotation);
  if (row.probe) return ProbeParameters(*row.probe);
  if (row.axis) return AxisParameters(*row.axis);
  return {};
}

absl::StatusOr<v1::CalibrationTrend> TrendOf(const v1::GetCalibrationTrendRequest& request,
                                             const std::vector<storage::CalibrationRow>& history) {
  const std::vector<CalibratedParameter> known = ParametersOf(history.front());
  if (absl::Status s = CheckNames(request, known); !s.ok()) return s;
  std::map<std::string, double> limits;
  for (const v1::ParameterLimit& limit : request.limits()) limits[limit.parameter()] = limit.limit();
  std::vector<std::string> order;
  for (const CalibratedParameter& p : known)
    if (request.parameters_size() == 0 ||
        std::find(request.parameters().begin(), request.parameters().end(), p.name) != request.parameters().end())
      order.push_back(p.name);
  std::map<std::string, Series> all = SeriesOf(history);
  const double coverage = request.coverage_factor() == 0 ? kUsualCoverage : request.coverage_factor();
  v1::CalibrationTrend trend;
  trend.set_machine(request.machine());
  trend.set_kind(request.kind());
  trend.set_axis(request.axis());
  trend.set_coverage_factor(coverage);
  trend.set_rule(
      "STEP: two neighbours differ by more than coverage_factor combined standard uncertainties; TREND: the slope of a "
      "weighted line is beyond Student's t for that probability; LIMIT: further from the first value than the limit "
      "stated");
  for (const std::string& name : order) {
    metrology::DriftOptions options;
    options.coverage_factor = coverage;
    if (limits.count(name) > 0) options.limit = limits[name];
    const absl::StatusOr<v1::ParameterTrend> parameter = TrendOfParameter(name, all[name], options);
    if (!parameter.ok()) return parameter.status();
    trend.set_alarm(trend.alarm() || parameter->alarms_size() > 0);
    *trend.add_parameters() = *parameter;
  }
  return trend;
}

}  // namespace sixpoint::calibration
