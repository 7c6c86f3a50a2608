// What every command that makes a calibration or a study takes beside its data.
#pragma once

#include <memory>
#include <optional>

#include "cli/command_line.h"
#include "cli/session.h"

namespace sixpoint::cli {

struct CalibrationOptions {
  bool draft = false;
  std::optional<double> temperature_c;
};

inline void AddTemperatureOption(Command* command, const std::shared_ptr<CalibrationOptions>& options) {
  command->AddOption("--temperature-c", &options->temperature_c, "Of machine and artefact");
}

inline void AddCalibrationOptions(Command* command, const std::shared_ptr<CalibrationOptions>& options) {
  command->AddFlag("--draft", &options->draft, "Not in force before `sixpoint calibration release`");
  AddTemperatureOption(command, options);
}

// The id that makes a retry safe, and the temperature.
template <typename Request>
void SetStudyOptions(const CalibrationOptions& options, Request* request) {
  if (options.temperature_c) request->mutable_environment()->set_temperature_c(*options.temperature_c);
  request->set_request_id(NewRequestId());
}

// The same, and whether it is a draft.
template <typename Request>
void SetCalibrationOptions(const CalibrationOptions& options, Request* request) {
  SetStudyOptions(options, request);
  request->set_draft(options.draft);
}

}  // namespace sixpoint::cli
