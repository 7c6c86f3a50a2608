#include "services/registration/validate.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "metrology/registration/allowance.h"
#include "refusal/message_text.h"
#include "services/clients/references.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::registration {
namespace {

constexpr double kGreatestCoordinateMm = 1e6;
constexpr double kGreatestRadiusMm = 1e4;

absl::Status CheckPlace(const std::string& field, bool given, const geometry::v1::Point& in) {
  if (!given) return runtime::Refuse(field, "not given", "a point in the part frame");
  const auto point = runtime::FromProto(field, in);
  if (!point.ok()) return point.status();
  if (point->cwiseAbs().maxCoeff() > kGreatestCoordinateMm)
    return runtime::Refuse(field, point->cwiseAbs().maxCoeff(), "coordinates up to 1e6 mm");
  return absl::OkStatus();
}

absl::Status CheckRegion(const std::string& field, const v1::Region& region) {
  const auto check_length = [](const std::string& of, double length_mm) {
    return length_mm > 0 && length_mm <= kGreatestRadiusMm
               ? absl::OkStatus()
               : runtime::Refuse(of, length_mm, "more than 0, at most 1e4 mm");
  };
  switch (region.shape_case()) {
    case v1::Region::kBox: {
      const v1::Box& box = region.box();
      absl::Status status = CheckPlace(field + ".box.minimum_mm", box.has_minimum_mm(), box.minimum_mm());
      if (status.ok()) status = CheckPlace(field + ".box.maximum_mm", box.has_maximum_mm(), box.maximum_mm());
      if (!status.ok()) return status;
      for (const auto& [axis, low, high] : {std::tuple("x_mm", box.minimum_mm().x_mm(), box.maximum_mm().x_mm()),
                                            std::tuple("y_mm", box.minimum_mm().y_mm(), box.maximum_mm().y_mm()),
                                            std::tuple("z_mm", box.minimum_mm().z_mm(), box.maximum_mm().z_mm())})
        if (!(low < high))
          return runtime::Refuse(field + ".box.maximum_mm." + axis, high, "more than its minimum, " + NumberText(low));
      return absl::OkStatus();
    }
    case v1::Region::kBall: {
      const v1::Ball& ball = region.ball();
      if (absl::Status status = CheckPlace(field + ".ball.centre_mm", ball.has_centre_mm(), ball.centre_mm());
          !status.ok())
        return status;
      return check_length(field + ".ball.radius_mm", ball.radius_mm());
    }
    case v1::Region::kHoleGroup:
      if (region.hole_group().group().empty())
        return runtime::Refuse(field + ".hole_group.group", "empty", "one of the part's hole groups");
      return check_length(field + ".hole_group.margin_mm", region.hole_group().margin_mm());
    case v1::Region::SHAPE_NOT_SET:
      break;
  }
  return runtime::Refuse(field, "no shape", "box, ball or hole_group");
}

absl::Status CheckAllowance(const v1::AllowanceOptions& asked) {
  const metrology::AllowanceOptions usual;
  const double least = asked.has_least_stock_mm() ? asked.least_stock_mm() : usual.least_stock_mm;
  const double greatest = asked.has_greatest_stock_mm() ? asked.greatest_stock_mm() : usual.greatest_stock_mm;
  runtime::Refusals refusals;
  if (!(std::abs(least) <= 10))
    refusals.Add(runtime::Refuse("options.allowance.least_stock_mm", least, "-10 to 10"));
  else if (!(greatest > std::max(0.0, least) && greatest <= 50))
    refusals.Add(runtime::Refuse("options.allowance.greatest_stock_mm", greatest,
                                 "more than the least stock and than 0, at most 50"));
  if (asked.has_patch_mm() && !(asked.patch_mm() >= 0.05 && asked.patch_mm() <= 50))
    refusals.Add(runtime::Refuse("options.allowance.patch_mm", asked.patch_mm(), "0.05 to 50"));
  if (asked.has_least_points() && !(asked.least_points() >= 1 && asked.least_points() <= 1'000'000))
    refusals.Add(runtime::Refuse("options.allowance.least_points", asked.least_points(), "1 to 1000000"));
  if (asked.has_least_side_part() && !(asked.least_side_part() >= 0 && asked.least_side_part() <= 1))
    refusals.Add(runtime::Refuse("options.allowance.least_side_part", asked.least_side_part(), "0 to 1"));
  return refusals.status();
}

// What is said of held directions, where there are such.
absl::Status CheckHeld(const std::string& field, double value, double greatest, bool holds) {
  if (!(value > 0 && value <= greatest))
    return runtime::Refuse(field, value, "> 0 and at most " + std::to_string(static_cast<int>(greatest)));
  if (!holds) return runtime::Refuse(field, value, "none, as no such direction is held");
  return absl::OkStatus();
}

absl::Status CheckFreedoms(const v1::RegisterRequest& request) {
  const v1::FitOptions& options = request.options();
  runtime::Refusals refusals;
  std::set<int> freedoms;
  for (int i = 0; i < options.degrees_of_freedom_size(); ++i) {
    const int freedom = options.degrees_of_freedom(i);
    const std::string field = "options.degrees_of_freedom[" + std::to_string(i) + "]";
    if (freedom < v1::FREEDOM_TURN_X || freedom > v1::FREEDOM_SHIFT_Z)
      refusals.Add(runtime::Refuse(field, freedom, "FREEDOM_TURN_X to FREEDOM_SHIFT_Z"));
    else if (!freedoms.insert(freedom).second)
      refusals.Add(runtime::Refuse(field, v1::Freedom_Name(options.degrees_of_freedom(i)), "each direction once"));
  }
  const bool held = !freedoms.empty() && freedoms.size() < 6;
  // One of the three turns, or of the three shifts.
  const auto holds = [&](int first) {
    return held && freedoms.count(first) + freedoms.count(first + 1) + freedoms.count(first + 2) < 3;
  };
  if (options.has_held_turn_standard_uncertainty_deg())
    refusals.Add(CheckHeld("options.held_turn_standard_uncertainty_deg", options.held_turn_standard_uncertainty_deg(),
                           10, holds(v1::FREEDOM_TURN_X)));
  if (options.has_held_shift_standard_uncertainty_um())
    refusals.Add(CheckHeld("options.held_shift_standard_uncertainty_um", options.held_shift_standard_uncertainty_um(),
                           10'000, holds(v1::FREEDOM_SHIFT_X)));
  if (held && IsSixPoint(request.method()))
    refusals.Add(runtime::Refuse("options.degrees_of_freedom", std::to_string(freedoms.size()) + " directions",
                                 "none named, as six points hold all six"));
  if (options.coarse_start() && (held || options.regions_in_size() > 0))
    refusals.Add(runtime::Refuse("options.coarse_start", held ? "true, with directions held" : "true, with regions_in",
                                 "neither held directions nor regions_in: the part is not found yet"));
  return refusals.status();
}

absl::Status CheckWeights(const v1::RegisterRequest& request) {
  const auto& weights = request.options().scan_weights();
  runtime::Refusals refusals;
  if (weights.size() != 0 && weights.size() != request.scans_size())
    refusals.Add(runtime::Refuse("options.scan_weights", std::to_string(weights.size()) + " weights",
                                 "none, or one for each of " + std::to_string(request.scans_size()) + " scans"));
  for (int i = 0; i < weights.size(); ++i)
    if (!(weights[i] >= 1e-6 && weights[i] <= 1e6))
      refusals.Add(runtime::Refuse("options.scan_weights[" + std::to_string(i) + "]", weights[i], "1e-6 to 1e6"));
  return refusals.status();
}

absl::Status CheckOptions(const v1::RegisterRequest& request) {
  const v1::FitOptions& options = request.options();
  runtime::Refusals refusals;
  refusals.Add(CheckFreedoms(request)).Add(CheckWeights(request));
  for (const auto& [name, regions] : {std::pair("options.regions_in", &options.regions_in()),
                                      std::pair("options.regions_out", &options.regions_out())})
    for (int i = 0; i < regions->size(); ++i)
      refusals.Add(CheckRegion(name + ("[" + std::to_string(i) + "]"), regions->Get(i)));
  if (options.has_allowance() && request.method() != v1::METHOD_ALLOWANCE)
    refusals.Add(
        runtime::Refuse("options.allowance", "set, with " + v1::Method_Name(request.method()), "METHOD_ALLOWANCE"));
  return refusals.Add(CheckAllowance(options.allowance())).status();
}

}  // namespace

std::string MethodText(v1::Method method) {
  switch (method) {
    case v1::METHOD_BEST_FIT:
      return "BEST_FIT";
    case v1::METHOD_LOCAL:
      return "LOCAL";
    case v1::METHOD_SIX_POINT:
      return "SIX_POINT";
    case v1::METHOD_SIX_POINT_NORMALS:
      return "SIX_POINT_NORMALS";
    case v1::METHOD_ALLOWANCE:
      return "ALLOWANCE";
    default:
      return "";
  }
}

bool IsSixPoint(v1::Method method) { return metrology::IsSixPoint(MethodOf(method)); }

metrology::Method MethodOf(v1::Method method) {
  switch (method) {
    case v1::METHOD_LOCAL:
      return metrology::Method::kLocal;
    case v1::METHOD_SIX_POINT:
      return metrology::Method::kSixPointPairs;
    case v1::METHOD_SIX_POINT_NORMALS:
      return metrology::Method::kSixPointNormals;
    case v1::METHOD_ALLOWANCE:
      return metrology::Method::kAllowance;
    default:
      return metrology::Method::kBestFit;
  }
}

absl::Status CheckRequest(const v1::RegisterRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("blade", "blades", request.blade()).status())
      .Add(runtime::CheckNames("scans", "scans", request.scans(), 1));
  if (MethodText(request.method()).empty())
    refusals.Add(runtime::Refuse(
        "method", request.method(),
        "METHOD_BEST_FIT, METHOD_LOCAL, METHOD_SIX_POINT, METHOD_SIX_POINT_NORMALS or METHOD_ALLOWANCE"));
  if (!request.sensor_calibration().empty())
    refusals.Add(runtime::IdOf("sensor_calibration", "calibrations", request.sensor_calibration()).status());
  return refusals.Add(CheckOptions(request)).status();
}

absl::Status CheckScan(const v1::RegisterRequest& request, const ingest::v1::Scan& scan,
                       const ingest::v1::Scan& first) {
  const std::string field = "scans[" + scan.name() + "]";
  if (scan.header().subject() != request.blade())
    return runtime::Refuse(field + ".subject", scan.header().subject(), request.blade());
  if (scan.header().machine() != first.header().machine())
    return runtime::Refuse(field + ".machine", scan.header().machine(),
                           first.header().machine() + ", as the first scan");
  if (scan.header().arm_series() != first.header().arm_series())
    return runtime::Refuse(field + ".arm_series", "'" + scan.header().arm_series() + "'",
                           "'" + first.header().arm_series() +
                               "', as the first scan: the arm was swung between them, and stands elsewhere");
  if (scan.header().clamping() != first.header().clamping())
    return runtime::Refuse(field + ".clamping", "'" + scan.header().clamping() + "'",
                           "'" + first.header().clamping() + "', as the first scan: the part stands elsewhere");
  if (scan.header().station() != first.header().station())
    return runtime::Refuse(field + ".station", "'" + scan.header().station() + "'",
                           "'" + first.header().station() + "', as the first scan: another blade stands there");
  if (!request.clamping().empty() && !scan.header().clamping().empty() &&
      scan.header().clamping() != request.clamping())
    return runtime::Refuse(field + ".clamping", "'" + scan.header().clamping() + "'",
                           "'" + request.clamping() + "', the clamping that was asked for");
  if (scan.header().sensor_serial_number() != first.header().sensor_serial_number())
    return runtime::Refuse(field + ".sensor_serial_number", "'" + scan.header().sensor_serial_number() + "'",
                           "'" + first.header().sensor_serial_number() + "', as the first scan");
  if (scan.header().travel() != first.header().travel())
    return runtime::Refuse(field + ".travel", ingest::v1::ScanTravel_Name(scan.header().travel()),
                           ingest::v1::ScanTravel_Name(first.header().travel()) + ", as the first scan");
  if (clients::CloudText(scan.header()) != clients::CloudText(first.header()))
    return runtime::Refuse(field + ".cloud", clients::CloudText(scan.header()),
                           clients::CloudText(first.header()) + ", as the first scan");
  if (scan.header().has_subject_temperature_c() != first.header().has_subject_temperature_c())
    return runtime::Refuse(field + ".subject_temperature_c",
                           scan.header().has_subject_temperature_c() ? "given" : "not given",
                           "a temperature of all scans, or of none");
  return absl::OkStatus();
}

metrology::AllowanceOptions AllowanceOptionsOf(const v1::FitOptions& options) {
  metrology::AllowanceOptions out;
  const v1::AllowanceOptions& asked = options.allowance();
  if (asked.has_least_stock_mm()) out.least_stock_mm = asked.least_stock_mm();
  if (asked.has_greatest_stock_mm()) out.greatest_stock_mm = asked.greatest_stock_mm();
  if (asked.has_patch_mm()) out.patch_mm = asked.patch_mm();
  if (asked.has_least_points()) out.least_points = asked.least_points();
  if (asked.has_least_side_part()) out.least_side_part = asked.least_side_part();
  return out;
}

v1::FitOptions FilledIn(const v1::RegisterRequest& request) {
  v1::FitOptions options = request.options();
  if (request.method() != v1::METHOD_ALLOWANCE) return options;
  const metrology::AllowanceOptions allowance = AllowanceOptionsOf(options);
  v1::AllowanceOptions& filled = *options.mutable_allowance();
  filled.set_least_stock_mm(allowance.least_stock_mm);
  filled.set_greatest_stock_mm(allowance.greatest_stock_mm);
  filled.set_patch_mm(allowance.patch_mm);
  filled.set_least_points(static_cast<int>(allowance.least_points));
  filled.set_least_side_part(allowance.least_side_part);
  return options;
}

}  // namespace sixpoint::registration
