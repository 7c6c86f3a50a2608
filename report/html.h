// A document as one HTML file: without scripts and without anything to load, to read, to print and to be read aloud.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "report/document.h"
#include "report/report.h"

namespace sixpoint::report {

// RESOURCE_EXHAUSTED where a picture cannot be written.
absl::StatusOr<std::string> ToHtml(const Document& document);

// INVALID_ARGUMENT as Check. The same report, the same bytes.
absl::StatusOr<std::string> WriteHtml(const Report& report);

}  // namespace sixpoint::report
