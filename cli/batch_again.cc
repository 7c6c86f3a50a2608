#include "cli/batch_again.h"

#include <algorithm>
#include <map>
#include <utility>

#include "cli/batch_document.h"
#include "cli/commands.h"
#include "cli/output.h"
#include "services/runtime/errors.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using registration::v1::Registration;
using registration::v1::RegistrationService;

constexpr int kRegistrationsAPage = 100;

// As it was, unless something stands for all.
registration::v1::RegisterRequest AgainRequest(const Registration& before, registration::v1::Method method,
                                               bool axis_tables) {
  registration::v1::RegisterRequest request;
  request.set_blade(before.blade());
  *request.mutable_scans() = before.scans();
  request.set_method(method == registration::v1::METHOD_UNSPECIFIED ? before.method() : method);
  const bool by_tables = std::any_of(before.angles().begin(), before.angles().end(),
                                     [](const auto& angle) { return !angle.characterisation().empty(); });
  request.set_apply_axis_tables(axis_tables || by_tables);
  // What was in force when its scans were received is not what it was mapped by: asked for once, it is asked for again.
  if (before.sensor_calibration_asked()) request.set_sensor_calibration(before.sensor_calibration());
  if (before.options().ByteSizeLong() > 0) *request.mutable_options() = before.options();
  if (request.has_options() && request.method() != registration::v1::METHOD_ALLOWANCE)
    request.mutable_options()->clear_allowance();
  return request;
}

}  // namespace

absl::StatusOr<Again> BatchOfLatest(Session* session, const std::vector<std::string>& blades,
                                    registration::v1::Method method, bool axis_tables) {
  if (blades.size() > kMostBatchRequests)
    return runtime::Refuse("--blades", std::to_string(blades.size()) + " blades", "at most 1000");
  Again again;
  for (const std::string& blade : blades) {
    registration::v1::ListRegistrationsRequest list;
    list.set_blade(NameText("blades", blade));
    list.set_page_size(1);
    list.set_without_for_inspection(true);
    registration::v1::ListRegistrationsResponse page;
    if (absl::Status status = session->Call<RegistrationService>(
            "registration", &RegistrationService::Stub::ListRegistrations, list, &page);
        !status.ok())
      return status;
    if (page.registrations_size() == 0)
      return runtime::Refuse("--blades", blade, "blades that were registered before; name its scans by --batch");
    *again.request.add_requests() = AgainRequest(page.registrations(0), method, axis_tables);
    again.before.push_back(page.registrations(0));
  }
  return again;
}

// Registrations are listed newest first: a blade's first one is its latest. In the order of the blades' names, so that the same
// command asks the same when it goes on.
absl::StatusOr<Again> BatchOfPart(Session* session, registration::v1::ListRegistrationsRequest which,
                                  registration::v1::Method method, bool axis_tables) {
  which.set_page_size(kRegistrationsAPage);
  which.set_without_for_inspection(true);
  std::map<std::string, Registration> latest;  // by blade
  const absl::Status listed =
      ForEachPage<RegistrationService>(session, "registration", &RegistrationService::Stub::ListRegistrations, which,
                                       [&](const registration::v1::ListRegistrationsResponse& page) {
                                         for (const Registration& one : page.registrations())
                                           latest.emplace(one.blade(), one);
                                       });
  if (!listed.ok()) return listed;
  if (latest.empty())
    return runtime::Refuse("--part", IdText(which.part()), "a part of which a blade was registered in that time");
  if (latest.size() > kMostBatchRequests)
    return runtime::Refuse("--since", TimeText(which.recorded().from()),
                           "a time with at most 1000 blades, not " + std::to_string(latest.size()));
  Again again;
  for (const auto& [blade, one] : latest) {
    *again.request.add_requests() = AgainRequest(one, method, axis_tables);
    again.before.push_back(one);
  }
  return again;
}

}  // namespace sixpoint::cli
