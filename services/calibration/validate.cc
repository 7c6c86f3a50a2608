#include "services/calibration/validate.h"

#include <cmath>
#include <utility>

#include "metrology/studies/arm_study.h"
#include "metrology/studies/gauge_study.h"
#include "refusal/message_text.h"
#include "services/clients/references.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {
namespace {

using runtime::Refuse;

constexpr int kGreatestTrendCount = 1000;
constexpr int kFewestCalibrations = 3;
constexpr double kMostLimitUm = 1000;  // of an interim check
constexpr double kMostTurnDeg = 10, kMostShiftUm = 10'000;

absl::Status CheckEnvironment(const v1::Environment& in) {
  const auto outside = [](double value, double least, double most) {
    return !std::isfinite(value) || value < least || value > most;
  };
  runtime::Refusals refusals;
  if (in.has_temperature_c() && outside(in.temperature_c(), -50, 100))
    refusals.Add(Refuse("environment.temperature_c", in.temperature_c(), "-50 to 100"));
  if (in.has_temperature_standard_uncertainty_c() && outside(in.temperature_standard_uncertainty_c(), 0, 50))
    refusals.Add(
        Refuse("environment.temperature_standard_uncertainty_c", in.temperature_standard_uncertainty_c(), "0 to 50"));
  if (in.has_temperature_standard_uncertainty_c() && !in.has_temperature_c())
    refusals.Add(Refuse("environment.temperature_c", "", "a temperature, of which the uncertainty is stated"));
  if (in.has_humidity_percent() && outside(in.humidity_percent(), 0, 100))
    refusals.Add(Refuse("environment.humidity_percent", in.humidity_percent(), "0 to 100"));
  return refusals.status();
}

absl::Status CheckLimit(const std::string& field, double value) {
  if (std::isfinite(value) && value >= 0) return absl::OkStatus();
  return Refuse(field, value, "> 0, or 0 for none");
}

// An uncertainty without which nothing may rest on what is stated.
absl::Status CheckStated(const std::string& field, double value, double most) {
  if (value > 0 && value <= most) return absl::OkStatus();
  return Refuse(field, value, "> 0 and at most " + NumberText(most));
}

}  // namespace

std::string Indexed(const std::string& field, int i) { return field + "[" + std::to_string(i) + "]"; }

absl::Status CheckCount(const std::string& field, int count, int least) {
  if (count >= least) return absl::OkStatus();
  return Refuse(field, std::to_string(count) + " of them", "at least " + std::to_string(least));
}

absl::Status CheckUncertainty(double value_um) {
  if (std::isfinite(value_um) && value_um >= 0 && value_um <= 100) return absl::OkStatus();
  return Refuse("standard_uncertainty_um", value_um, "0 (not stated) to 100");
}

absl::Status CheckRequest(const v1::CalibrateSensorRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("machine", "machines", request.machine()).status())
      .Add(runtime::IdOf("artefact", "artefacts", request.artefact()).status())
      .Add(runtime::CheckNames("scans", "scans", request.scans(), 1));
  if (!request.has_touch()) refusals.Add(Refuse("touch", "", "the artefact as the touch probe measured it"));
  if (!v1::SensorMethod_IsValid(request.method()))
    refusals.Add(Refuse("method", request.method(), "JOINT or SEQUENTIAL"));
  if (absl::Status s = refusals.status(); !s.ok()) return s;
  return CheckEnvironment(request.environment());
}

absl::Status CheckRequest(const v1::StateSensorPoseRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("machine", "machines", request.machine()).status())
      .Add(CheckStated("turn_standard_uncertainty_deg", request.turn_standard_uncertainty_deg(), kMostTurnDeg))
      .Add(CheckStated("shift_standard_uncertainty_um", request.shift_standard_uncertainty_um(), kMostShiftUm));
  if (!request.has_machine_from_sensor())
    refusals.Add(Refuse("machine_from_sensor", "missing", "where the sensor stands with the linear axes at 0"));
  if (request.certificate().empty())
    refusals.Add(Refuse("certificate", "", "number and issuer of what says how the sensor stands"));
  return refusals.status();
}

absl::Status CheckRequest(const v1::CalibrateRotationRequest& request) {
  const bool standard = request.method() == v1::ROTATION_METHOD_STANDARD;
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("machine", "machines", request.machine()).status())
      .Add(CheckCount("poses", request.poses_size(), standard ? 0 : 1));
  if (!v1::RotationMethod_IsValid(request.method()))
    refusals.Add(Refuse("method", request.method(), "LINES, POINT_C or STANDARD"));
  if (standard != request.has_standard())
    refusals.Add(
        Refuse("standard", standard ? "" : "given", standard ? "bore and face" : "none but for method STANDARD"));
  refusals.Add(CheckUncertainty(request.standard_uncertainty_um()));
  if (absl::Status s = refusals.status(); !s.ok()) return s;
  return CheckEnvironment(request.environment());
}

absl::Status CheckRequest(const v1::CalibrateProbeRequest& request) {
  if (absl::Status s = runtime::IdOf("machine", "machines", request.machine()).status(); !s.ok()) return s;
  if (absl::Status s = runtime::CheckId("block", request.block()); !s.ok()) return s;
  if (absl::Status s = CheckCount("faces", request.faces_size(), 1); !s.ok()) return s;
  if (absl::Status s = CheckCount("readings", request.readings_size(), 1); !s.ok()) return s;
  const int moved = request.moved_readings_size();
  if ((moved > 0) != (request.moved_faces_size() > 0))
    return Refuse("moved_readings", std::to_string(moved) + " of them", "both moved_faces and moved_readings, or none");
  if (!v1::ProbeMethod_IsValid(request.method()))
    return Refuse("method", std::to_string(request.method()), "WEIGHTED or LINEAR");
  return CheckEnvironment(request.environment());
}

absl::Status CheckRequest(const v1::CharacteriseAxisRequest& request) {
  if (absl::Status s = runtime::IdOf("machine", "machines", request.machine()).status(); !s.ok()) return s;
  if (request.axis().empty()) return Refuse("axis", "", "the letter of a rotary axis");
  if (absl::Status s = runtime::CheckId("axis", request.axis()); !s.ok()) return s;
  return CheckEnvironment(request.environment());
}

absl::Status CheckScan(const v1::CalibrateSensorRequest& request, const ingest::v1::Scan& scan,
                       const ingest::v1::Scan& first) {
  const ingest::v1::ScanHeader& header = scan.header();
  if (header.machine() != request.machine())
    return Refuse("scans", scan.name() + " of " + header.machine(), "scans of " + request.machine());
  if (header.subject() != request.artefact())
    return Refuse("scans", scan.name() + " of " + header.subject(), "scans of " + request.artefact());
  // The touch data are of one place: the artefact stands on axes that must not have turned in between.
  if (header.a_deg() != first.header().a_deg() || header.b_deg() != first.header().b_deg())
    return Refuse("scans", scan.name() + " at A " + NumberText(header.a_deg()) + ", B " + NumberText(header.b_deg()),
                  "A and B as in " + first.name());
  return clients::CheckProfiles("scans", scan);
}

absl::Status CheckRequest(const v1::WithdrawCalibrationRequest& request) {
  return request.reason().empty() ? Refuse("reason", "", "why it must not be used") : absl::OkStatus();
}

absl::Status CheckRequest(const v1::GetCalibrationTrendRequest& request) {
  const double coverage = request.coverage_factor();
  if (coverage != 0 && (!std::isfinite(coverage) || coverage < 1 || coverage > 8))
    return Refuse("coverage_factor", coverage, "1 to 8, or 0 for 3");
  if (request.most_count() < 0 || request.most_count() > kGreatestTrendCount)
    return Refuse("most_count", std::to_string(request.most_count()), "0 to 1000");
  return absl::OkStatus();
}

absl::Status CheckRequest(const v1::RunGaugeStudyRequest& request) {
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  return runtime::CheckNames("scans", "scans", request.scans(), metrology::kFewestGaugeScans);
}

absl::Status CheckRequest(const v1::RunArmStudyRequest& request) {
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  if (absl::Status s = CheckLimit("limit_um", request.limit_um()); !s.ok()) return s;
  return runtime::CheckNames("scans", "scans", request.scans(), metrology::kFewestArmScans);
}

absl::Status CheckRequest(const v1::RunRepeatStudyRequest& request) {
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  return runtime::CheckNames("calibrations", "calibrations", request.calibrations(), kFewestCalibrations);
}

absl::Status CheckRequest(const v1::RunGaugeRrRequest& request) {
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  if (absl::Status s = CheckLimit("limit_percent", request.limit_percent()); !s.ok()) return s;
  for (const auto& [field, text] : {std::pair<const char*, const std::string&>{"outer_name", request.outer_name()},
                                    {"inner_name", request.inner_name()},
                                    {"unit", request.unit()}})
    if (text.empty()) return Refuse(field, "", "a name");
  if (!v1::PartLevel_IsValid(request.part_level()))
    return Refuse("part_level", std::to_string(request.part_level()), "INNER or OUTER");
  return absl::OkStatus();
}

absl::Status CheckRequest(const v1::RunSphereCheckRequest& request) {
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  for (int i = 0; i < request.lengths_size(); ++i)
    if (request.lengths(i).standard().empty()) return Refuse(Indexed("lengths", i) + ".standard", "", "a name");
  return absl::OkStatus();
}

absl::Status CheckRequest(const v1::RunInterimCheckRequest& request) {
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  if (absl::Status s = runtime::IdOf("machine", "machines", request.machine()).status(); !s.ok()) return s;
  if (!(request.limit_um() >= 0 && request.limit_um() <= kMostLimitUm))
    return Refuse("limit_um", request.limit_um(), "> 0 and at most 1000, or 0 for the machine's");
  if (!request.sensor_calibration().empty())
    if (absl::Status s = runtime::IdOf("sensor_calibration", "calibrations", request.sensor_calibration()).status();
        !s.ok())
      return s;
  return runtime::CheckNames("scans", "scans", request.scans(), 1);
}

absl::Status CheckStudyScan(const ingest::v1::Scan& scan, const ingest::v1::Scan& first, bool arm_only) {
  const ingest::v1::ScanHeader &header = scan.header(), &wanted = first.header();
  const bool artefact = header.kind() == ingest::v1::SCAN_KIND_ARM || header.kind() == ingest::v1::SCAN_KIND_ARTEFACT;
  if (arm_only ? header.kind() != ingest::v1::SCAN_KIND_ARM : !artefact)
    return Refuse("scans", scan.name() + " of kind " + ingest::v1::ScanKind_Name(header.kind()),
                  arm_only ? "scans of kind SCAN_KIND_ARM" : "scans of kind SCAN_KIND_ARM or SCAN_KIND_ARTEFACT");
  if (header.machine() != wanted.machine())
    return Refuse("scans", scan.name() + " of " + header.machine(), "scans of " + wanted.machine());
  if (header.subject() != wanted.subject())
    return Refuse("scans", scan.name() + " of " + header.subject(), "scans of " + wanted.subject());
  if (header.a_deg() != wanted.a_deg() || header.b_deg() != wanted.b_deg())
    return Refuse("scans", scan.name() + " at A " + NumberText(header.a_deg()) + ", B " + NumberText(header.b_deg()),
                  "A and B as in " + first.name());
  return clients::CheckProfiles("scans", scan);
}

}  // namespace sixpoint::calibration
