#include "services/inspection/positioning.h"

#include "services/clients/registered_pose.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/requests.h"

namespace sixpoint::inspection {
namespace {

// Of the tightest position tolerance, what the surface's shape may deviate before the positioning matters.
constexpr double kShapeOfTolerance = 0.1;

registration::v1::Method MethodOf(const v1::InspectRequest& request) {
  return request.method() == registration::v1::METHOD_UNSPECIFIED ? registration::v1::METHOD_SIX_POINT
                                                                  : request.method();
}

// Whatever its outcome is. What is not the method that was asked for stands only beside it, and takes all the part.
absl::StatusOr<registration::v1::Registration> Register(const clients::BladePeers& peers,
                                                        const v1::InspectRequest& request,
                                                        registration::v1::Method method,
                                                        const runtime::Caller& caller) {
  registration::v1::RegisterRequest wanted;
  wanted.set_blade(request.blade());
  *wanted.mutable_scans() = request.scans();
  wanted.set_method(method);
  if (request.has_options()) *wanted.mutable_options() = request.options();
  wanted.set_apply_axis_tables(request.apply_axis_tables());
  wanted.set_for_inspection(true);
  wanted.set_sensor_calibration(request.sensor_calibration());
  // Answers are kept by method and id: a retry of this inspection finds the registrations that it made.
  wanted.set_request_id(request.request_id());
  if (method != MethodOf(request)) {
    if (wanted.has_options()) wanted.mutable_options()->clear_regions_in();
    if (!request.request_id().empty())
      wanted.set_request_id(storage::UuidFrom(request.request_id() + " " + registration::v1::Method_Name(method)));
  }
  return peers.registrations.Register(wanted, caller.make_context());
}

// None where the part or what was asked for does not allow this positioning, or its fit gives no pose: the result says
// that it lacks. A plant that cannot register now (its calibration, its points, a service that is away) ends the call.
absl::StatusOr<std::optional<registration::v1::Registration>> Other(const OtherPositioning& find,
                                                                    registration::v1::Method method,
                                                                    Compared* compared) {
  absl::StatusOr<registration::v1::Registration> other = find(method);
  if (absl::IsInvalidArgument(other.status()) || runtime::HasReason(other.status(), errors::v1::SIX_POINTS_MISSING))
    return std::nullopt;
  if (!other.ok()) return other.status();
  compared->names.push_back(other->name());
  if (!clients::CheckConverged(*other).ok()) return std::nullopt;
  return *std::move(other);
}

}  // namespace

absl::StatusOr<registration::v1::Registration> RegisterAsked(const clients::BladePeers& peers,
                                                             const v1::InspectRequest& request,
                                                             const runtime::Caller& caller) {
  return Register(peers, request, MethodOf(request), caller);
}

OtherPositioning RegisteredNow(const clients::BladePeers& peers, const v1::InspectRequest& request,
                               const runtime::Caller& caller) {
  return [&](registration::v1::Method method) { return Register(peers, request, method, caller); };
}

OtherPositioning RegisteredThen(const std::vector<registration::v1::Registration>& recorded) {
  return [recorded](registration::v1::Method method) -> absl::StatusOr<registration::v1::Registration> {
    for (const registration::v1::Registration& one : recorded)
      if (one.method() == method) return one;
    return absl::InvalidArgumentError(registration::v1::Method_Name(method) + " was not recorded with it");
  };
}

// Six-point and a local fit by regions were compared with the best fit by registration; a best fit is compared with the pairs.
// Where they disagree, the part's shape is not its CAD's: the best fit and the nest of six datum points are what the drawing
// may mean.
absl::StatusOr<Compared> Compare(const OtherPositioning& other, const registration::v1::Registration& registration,
                                 double tightest_um) {
  Compared compared;
  const registration::v1::Method method = registration.method();
  if (registration.evidence().has_disagreement()) compared.disagreement = registration.evidence().disagreement();
  if (method == registration::v1::METHOD_BEST_FIT) {
    const auto pairs = Other(other, registration::v1::METHOD_SIX_POINT, &compared);
    if (!pairs.ok()) return pairs.status();
    if (pairs->has_value() && (*pairs)->evidence().has_disagreement())
      compared.disagreement = (*pairs)->evidence().disagreement();
  }
  compared.disagrees = (compared.disagreement && compared.disagreement->beyond()) ||
                       registration.evidence().model_sigma_um() > kShapeOfTolerance * tightest_um;
  if (!compared.disagrees || method == registration::v1::METHOD_SIX_POINT_NORMALS) return compared;
  compared.covered = true;
  for (const registration::v1::Method another :
       {registration::v1::METHOD_BEST_FIT, registration::v1::METHOD_SIX_POINT_NORMALS}) {
    if (another == method) continue;
    const auto found = Other(other, another, &compared);
    if (!found.ok()) return found.status();
    if (!found->has_value()) {
      compared.covered = false;
      continue;
    }
    const auto pose = runtime::FromProto("registration.zero_from_part", (*found)->zero_from_part());
    if (!pose.ok()) return pose.status();
    compared.other_zero_from_part.push_back(*pose);
  }
  return compared;
}

}  // namespace sixpoint::inspection
