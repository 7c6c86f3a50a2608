#include "services/registration/validate.h"

#include <cmath>
#include <set>

#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::registration {
namespace {

constexpr std::size_t kLongestRequester = 200;

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
    default:
      return "";
  }
}

bool IsSixPoint(v1::Method method) { return method == v1::METHOD_SIX_POINT || method == v1::METHOD_SIX_POINT_NORMALS; }

absl::Status CheckRequest(const v1::RegisterRequest& request) {
  if (const auto blade = runtime::IdOf("blade", "blades", request.blade()); !blade.ok()) return blade.status();
  if (request.scans_size() < 1 || request.scans_size() > kGreatestScanCount)
    return runtime::Refuse("scans", std::to_string(request.scans_size()) + " scans",
                           "1 to " + std::to_string(kGreatestScanCount));
  std::set<std::string> seen;
  for (int i = 0; i < request.scans_size(); ++i) {
    const std::string field = "scans[" + std::to_string(i) + "]";
    if (const auto scan = runtime::IdOf(field, "scans", request.scans(i)); !scan.ok()) return scan.status();
    if (!seen.insert(request.scans(i)).second) return runtime::Refuse(field, request.scans(i), "each scan once");
  }
  if (MethodText(request.method()).empty())
    return runtime::Refuse("method", std::to_string(request.method()),
                           "METHOD_BEST_FIT, METHOD_LOCAL, METHOD_SIX_POINT or METHOD_SIX_POINT_NORMALS");
  if (request.requested_by().size() > kLongestRequester)
    return runtime::Refuse("requested_by", std::to_string(request.requested_by().size()) + " bytes", "at most 200");
  return runtime::CheckUuid("request_id", request.request_id());
}

absl::Status CheckScan(const v1::RegisterRequest& request, const ingest::v1::Scan& scan,
                       const ingest::v1::Scan& first) {
  const std::string field = "scans[" + scan.name() + "]";
  if (scan.header().subject() != request.blade())
    return runtime::Refuse(field + ".subject", scan.header().subject(), request.blade());
  if (scan.header().machine() != first.header().machine())
    return runtime::Refuse(field + ".machine", scan.header().machine(),
                           first.header().machine() + ", as the first scan");
  return absl::OkStatus();
}

absl::StatusOr<std::vector<metrology::DatumPoint>> DatumsOf(const plant::v1::Part& part) {
  if (part.six_points_size() != 6)
    return runtime::Failure(absl::StatusCode::kFailedPrecondition, "SIX_POINTS_MISSING",
                            "method: six-point for " + part.name() + ", whose six_points has " +
                                std::to_string(part.six_points_size()) +
                                " points, want 6; add them to the part or ask for METHOD_BEST_FIT");
  std::vector<metrology::DatumPoint> datums;
  for (const plant::v1::DatumPoint& in : part.six_points()) {
    const std::string field = "part.six_points[" + in.datum() + "]";
    const auto point = runtime::FromProto(field + ".point_in_part_mm", in.point_in_part_mm());
    if (!point.ok()) return point.status();
    const auto normal = runtime::FromProto(field + ".normal_in_part", in.normal_in_part());
    if (!normal.ok()) return normal.status();
    datums.push_back({in.datum(), *point, *normal});
  }
  return datums;
}

}  // namespace sixpoint::registration
