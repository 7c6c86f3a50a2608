// Requests into what the kernel takes: pure functions, each refusal naming field, value and what was wanted.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/registration/register.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::registration {

constexpr int kGreatestScanCount = 64;

// "BEST_FIT", "LOCAL", ...; empty for what is no method.
std::string MethodText(v1::Method method);
bool IsSixPoint(v1::Method method);
// The kernel's, of a method that has a text.
metrology::Method MethodOf(v1::Method method);

// Names, counts, method and options.
absl::Status CheckRequest(const v1::RegisterRequest& request);
// The scan shows this blade, on the machine of the first scan, and no artefact.
absl::Status CheckScan(const v1::RegisterRequest& request, const ingest::v1::Scan& scan, const ingest::v1::Scan& first);
// FAILED_PRECONDITION (SIX_POINTS_MISSING) unless the part has six.
absl::StatusOr<std::vector<metrology::DatumPoint>> DatumsOf(const plant::v1::Part& part);

// The options of a good request. Hole groups become balls round the part's hole starts; INVALID_ARGUMENT: the part has no such
// group.
absl::StatusOr<metrology::FitOptions> FitOptionsOf(const v1::FitOptions& options, const plant::v1::Part& part);
metrology::AllowanceOptions AllowanceOptionsOf(const v1::FitOptions& options);
// As asked, and of METHOD_ALLOWANCE what was left open filled in.
v1::FitOptions FilledIn(const v1::RegisterRequest& request);

}  // namespace sixpoint::registration
