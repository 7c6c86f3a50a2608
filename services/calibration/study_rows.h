// A study that was made as it is recorded: its row and its journal entry.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <utility>

#include "services/runtime/recorded_call.h"
#include "services/runtime/server.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

// With a new id; the request's bytes are kept with it.
absl::StatusOr<runtime::Made<storage::StudyRow>> RecordOf(const v1::Study& study, std::string request_bytes);

// The same, once it says who asked for it, and where and when it was measured.
template <typename Request>
absl::StatusOr<runtime::Made<storage::StudyRow>> RecordOf(const Request& request, v1::Study study) {
  study.set_software_version(runtime::SoftwareVersion());
  if (request.has_environment()) *study.mutable_environment() = request.environment();
  return RecordOf(study, request.SerializeAsString());
}

}  // namespace sixpoint::calibration
