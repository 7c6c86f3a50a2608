// What a request must be: checks only, each refusal naming field, value and what was wanted.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "metrology/registration/allowance.h"
#include "metrology/registration/register.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::registration {

// "BEST_FIT", "LOCAL", ...; empty for what is no method.
std::string MethodText(v1::Method method);
bool IsSixPoint(v1::Method method);
// The kernel's, of a method that has a text.
metrology::Method MethodOf(v1::Method method);

// Names, counts, method and options.
absl::Status CheckRequest(const v1::RegisterRequest& request);
// The scan shows this blade, on the machine of the first scan and by its kind of points, and no artefact.
absl::Status CheckScan(const v1::RegisterRequest& request, const ingest::v1::Scan& scan, const ingest::v1::Scan& first);

metrology::AllowanceOptions AllowanceOptionsOf(const v1::FitOptions& options);
// As asked, and of METHOD_ALLOWANCE what was left open filled in.
v1::FitOptions FilledIn(const v1::RegisterRequest& request);

}  // namespace sixpoint::registration
