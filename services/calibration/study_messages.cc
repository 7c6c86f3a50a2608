#include "services/calibration/study_messages.h"

#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <map>

#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::calibration {
namespace {

v1::Spread ToProto(const std::string& quantity, const std::string& unit, const metrology::Spread& in) {
  v1::Spread out;
  out.set_quantity(quantity);
  out.set_unit(unit);
  out.set_count(in.count);
  out.set_minimum(in.minimum);
  out.set_maximum(in.maximum);
  out.set_mean(in.mean);
  out.set_mean_standard_uncertainty(in.mean_standard_uncertainty);
  out.set_standard_deviation(in.standard_deviation);
  out.set_standard_deviation_standard_uncertainty(in.standard_deviation_standard_uncertainty);
  return out;
}

// Of values that each come with a standard uncertainty of their own.
v1::Spread SpreadWithStated(const std::string& quantity, const std::string& unit, const std::vector<double>& values,
                            const std::vector<double>& uncertainties) {
  v1::Spread out = ToProto(quantity, unit, metrology::SpreadOf(values));
  double squares = 0;
  for (const double u : uncertainties) squares += u * u;
  out.set_stated_standard_uncertainty(std::sqrt(squares / static_cast<double>(uncertainties.size())));
  return out;
}

v1::VarianceLine LineOf(const std::string& source, const metrology::VarianceLine& in) {
  v1::VarianceLine out;
  out.set_source(source);
  out.set_degrees_of_freedom(in.degrees_of_freedom);
  out.set_sum_of_squares(in.sum_of_squares);
  out.set_mean_square(in.mean_square);
  if (in.f) out.set_f(*in.f);
  if (in.p) out.set_p(*in.p);
  out.set_variance(in.variance);
  out.set_variance_lower(in.interval.lower);
  out.set_variance_upper(in.interval.upper);
  out.set_standard_deviation(std::sqrt(in.variance));
  out.set_percent_of_variance(in.percent);
  out.set_negative(in.negative);
  return out;
}

std::string WithoutPrefix(const std::string& name, const std::string& prefix) {
  const std::string text = name.substr(prefix.size());
  return text == "UNSPECIFIED" ? "" : text;
}

}  // namespace

std::string KindText(v1::StudyKind kind) {
  return v1::StudyKind_IsValid(kind) ? WithoutPrefix(v1::StudyKind_Name(kind), "STUDY_KIND_") : "";
}

std::string VerdictText(v1::StudyVerdict verdict) {
  return WithoutPrefix(v1::StudyVerdict_Name(verdict), "STUDY_VERDICT_");
}

v1::StudyVerdict ToProto(metrology::StudyVerdict verdict) {
  switch (verdict) {
    case metrology::StudyVerdict::kAccepted:
      return v1::STUDY_VERDICT_ACCEPTED;
    case metrology::StudyVerdict::kRejected:
      return v1::STUDY_VERDICT_REJECTED;
    case metrology::StudyVerdict::kUndecidable:
      return v1::STUDY_VERDICT_UNDECIDABLE;
    case metrology::StudyVerdict::kReported:
      return v1::STUDY_VERDICT_REPORTED;
  }
  return v1::STUDY_VERDICT_UNSPECIFIED;
}

v1::GaugeStudy ToProto(const metrology::GaugeStudy& study, double limit_um) {
  v1::GaugeStudy out;
  out.set_scan_count(study.scan_count);
  out.set_station_count(static_cast<int>(study.stations.size()));
  out.set_median_oscillation_um(runtime::kUmPerMm * study.median_oscillation_mm);
  out.set_median_oscillation_standard_uncertainty_um(runtime::kUmPerMm *
                                                     study.median_oscillation_standard_uncertainty_mm);
  out.set_greatest_oscillation_um(runtime::kUmPerMm * study.greatest_oscillation_mm);
  out.set_standard_deviation_um(runtime::kUmPerMm * study.standard_deviation_mm);
  out.set_standard_deviation_standard_uncertainty_um(runtime::kUmPerMm *
                                                     study.standard_deviation_standard_uncertainty_mm);
  out.set_drift_um(runtime::kUmPerMm * study.drift_mm);
  out.set_drift_standard_uncertainty_um(runtime::kUmPerMm * study.drift_standard_uncertainty_mm);
  out.set_limit_um(limit_um);
  for (const metrology::GaugeStation& s : study.stations) {
    v1::GaugeStation* station = out.add_stations();
    station->set_x_mm(s.x_mm);
    station->set_y_mm(s.y_mm);
    station->set_mean_z_mm(s.mean_z_mm);
    station->set_oscillation_um(runtime::kUmPerMm * s.oscillation_mm);
    station->set_standard_deviation_um(runtime::kUmPerMm * s.standard_deviation_mm);
  }
  return out;
}

v1::ArmStudy ToProto(const std::vector<metrology::ArmDisplacement>& displacements, double limit_um) {
  v1::ArmStudy out;
  out.set_scan_count(static_cast<int>(displacements.size()));
  out.set_limit_um(limit_um);
  std::vector<double> values[6], uncertainties[6];
  for (const metrology::ArmDisplacement& d : displacements) {
    v1::ArmDisplacement* row = out.add_displacements();
    row->set_scan(runtime::NameOf("scans", d.scan));
    row->set_dx_mm(d.translation_mm.x());
    row->set_dy_mm(d.translation_mm.y());
    row->set_dz_mm(d.translation_mm.z());
    row->set_dalpha_deg(runtime::kDegPerRad * d.angles.alpha);
    row->set_dbeta_deg(runtime::kDegPerRad * d.angles.beta);
    row->set_dgamma_deg(runtime::kDegPerRad * d.angles.gamma);
    row->set_residual_rms_um(runtime::kUmPerMm * d.residual_rms_mm);
    if (&d == &displacements.front()) continue;  // against itself
    const double row_values[6] = {row->dx_mm(),      row->dy_mm(),     row->dz_mm(),
                                  row->dalpha_deg(), row->dbeta_deg(), row->dgamma_deg()};
    for (int k = 0; k < 6; ++k) {
      const int at = (k + 3) % 6;  // the covariance has the rotation first
      values[k].push_back(row_values[k]);
      uncertainties[k].push_back((k < 3 ? 1 : runtime::kDegPerRad) * std::sqrt(d.covariance(at, at)));
    }
  }
  const char* names[6] = {"dx", "dy", "dz", "dalpha", "dbeta", "dgamma"};
  for (int k = 0; k < 6; ++k)
    *out.add_spreads() = SpreadWithStated(names[k], k < 3 ? "mm" : "deg", values[k], uncertainties[k]);
  return out;
}

v1::StudyVerdict VerdictOf(const v1::ArmStudy& study) {
  const v1::Spread* worst = nullptr;
  for (const v1::Spread& spread : study.spreads())
    if (spread.unit() == "mm" && (worst == nullptr || spread.standard_deviation() > worst->standard_deviation()))
      worst = &spread;
  if (worst == nullptr) return v1::STUDY_VERDICT_REPORTED;
  return ToProto(metrology::JudgeAgainst(study.limit_um(), runtime::kUmPerMm * worst->standard_deviation(),
                                         runtime::kUmPerMm * worst->standard_deviation_standard_uncertainty()));
}

v1::RepeatStudy RepeatOf(const std::vector<storage::CalibrationRow>& calibrations) {
  std::vector<double> values[6], uncertainties[6];
  std::map<std::string, std::vector<double>> errors;  // by feature, one for each calibration
  for (const storage::CalibrationRow& row : calibrations) {
    const storage::SensorCalibrationRow& s = *row.sensor;
    const double row_values[6] = {s.alpha_deg,     s.beta_deg,      s.gamma_deg,
                                  s.t_sm_mm.at(0), s.t_sm_mm.at(1), s.t_sm_mm.at(2)};
    const double row_uncertainties[6] = {s.alpha_standard_uncertainty_deg, s.beta_standard_uncertainty_deg,
                                         s.gamma_standard_uncertainty_deg, std::sqrt(s.covariance.at(21)),
                                         std::sqrt(s.covariance.at(28)),   std::sqrt(s.covariance.at(35))};
    for (int k = 0; k < 6; ++k) {
      values[k].push_back(row_values[k]);
      uncertainties[k].push_back(row_uncertainties[k]);
    }
    std::map<std::string, std::vector<double>> distances;
    for (const storage::CentreResidualRow& c : s.centres)
      distances[c.feature].push_back(std::sqrt(c.dx_um * c.dx_um + c.dy_um * c.dy_um + c.dz_um * c.dz_um));
    for (const auto& [feature, of_scans] : distances) errors[feature].push_back(metrology::SpreadOf(of_scans).mean);
  }
  v1::RepeatStudy out;
  const char* names[6] = {"alpha", "beta", "gamma", "T_sm x", "T_sm y", "T_sm z"};
  for (int k = 0; k < 6; ++k)
    *out.add_parameters() = SpreadWithStated(names[k], k < 3 ? "deg" : "mm", values[k], uncertainties[k]);
  for (const auto& [feature, distances] : errors)
    *out.add_centre_errors() = ToProto(feature, "um", metrology::SpreadOf(distances));
  return out;
}

v1::GaugeRr ToProto(const metrology::NestedVariance& in, const v1::RunGaugeRrRequest& request) {
  v1::GaugeRr out;
  out.set_outer_name(request.outer_name());
  out.set_inner_name(request.inner_name());
  out.set_unit(request.unit());
  out.set_balanced(in.balanced);
  out.set_confidence(request.confidence());
  out.set_mean(in.mean);
  out.set_mean_standard_uncertainty(in.mean_standard_uncertainty);
  *out.add_lines() = LineOf(request.outer_name(), in.outer);
  *out.add_lines() = LineOf(request.inner_name() + " within " + request.outer_name(), in.inner);
  *out.add_lines() = LineOf("repeat", in.repeat);
  v1::VarianceLine* total = out.add_lines();
  total->set_source("total");
  total->set_degrees_of_freedom(in.total_degrees_of_freedom);
  total->set_sum_of_squares(in.total_sum_of_squares);
  total->set_variance(in.outer.variance + in.inner.variance + in.repeat.variance);
  total->set_standard_deviation(std::sqrt(total->variance()));
  total->set_percent_of_variance(total->variance() > 0 ? 100 : 0);
  out.set_gauge_rr_standard_deviation(std::sqrt(in.gauge_rr_variance));
  out.set_gauge_rr_lower(std::sqrt(in.gauge_rr_interval.lower));
  out.set_gauge_rr_upper(std::sqrt(in.gauge_rr_interval.upper));
  out.set_gauge_rr_percent_of_total(in.gauge_rr_percent);
  if (in.distinct_categories) out.set_distinct_categories(*in.distinct_categories);
  out.set_part_level(request.part_level());
  out.set_limit_percent(request.limit_percent());
  return out;
}

v1::SphereCheck ToProto(const metrology::SphereCheck& in) {
  v1::SphereCheck out;
  runtime::ToProto(in.centre_mm, out.mutable_centre_mm());
  const Eigen::Vector3d sigma = in.centre_covariance_mm2.diagonal().cwiseMax(0).cwiseSqrt();
  runtime::ToProto(sigma, out.mutable_centre_standard_uncertainty_mm());
  out.set_fitted_diameter_mm(in.diameter_mm);
  out.set_fitted_diameter_standard_uncertainty_um(runtime::kUmPerMm * in.diameter_standard_uncertainty_mm);
  out.set_standard_deviation_um(runtime::kUmPerMm * in.standard_deviation_mm);
  for (const metrology::CheckedError& e : in.errors) {
    v1::CheckedError* error = out.add_errors();
    error->set_quantity(e.quantity);
    error->set_error_um(runtime::kUmPerMm * e.error_mm);
    error->set_expanded_uncertainty_um(2 * runtime::kUmPerMm * e.standard_uncertainty_mm);
    if (e.mpe_mm > 0) error->set_mpe_um(runtime::kUmPerMm * e.mpe_mm);
    error->set_verdict(ToProto(e.verdict));
  }
  return out;
}

v1::InterimCheck ToProto(const metrology::InterimCheck& in, const v1::InterimCheck& said) {
  v1::InterimCheck out = said;
  out.set_dx_mm(in.translation_mm.x());
  out.set_dy_mm(in.translation_mm.y());
  out.set_dz_mm(in.translation_mm.z());
  out.set_dalpha_deg(runtime::kDegPerRad * in.angles.alpha);
  out.set_dbeta_deg(runtime::kDegPerRad * in.angles.beta);
  out.set_dgamma_deg(runtime::kDegPerRad * in.angles.gamma);
  for (const metrology::PlaceDisplacement& p : in.places) {
    v1::InterimPlace* place = out.add_places();
    place->set_y_mm(p.y_mm);
    place->set_z_mm(p.z_mm);
    place->set_dx_um(runtime::kUmPerMm * p.displacement_mm.x());
    place->set_dy_um(runtime::kUmPerMm * p.displacement_mm.y());
    place->set_dz_um(runtime::kUmPerMm * p.displacement_mm.z());
    place->set_distance_um(runtime::kUmPerMm * p.distance_mm);
    place->set_bound_um(runtime::kUmPerMm * p.upper_mm);
  }
  out.set_worst_place(static_cast<int>(in.worst));
  out.set_swing_count(in.swing_count);
  return out;
}

absl::StatusOr<v1::Study> ToProto(const storage::StudyRow& row) {
  v1::Study study;
  const auto parsed = google::protobuf::util::JsonStringToMessage(row.result_json, &study);
  if (!parsed.ok()) return absl::DataLossError("study " + row.study_id + ": its result cannot be read");
  study.set_name(runtime::NameOf("studies", row.study_id));
  study.set_requested_by(row.requested_by);
  runtime::ToProto(row.recorded.recorded_at, study.mutable_recorded_at());
  study.set_record_sequence(row.recorded.sequence);
  return study;
}

}  // namespace sixpoint::calibration
