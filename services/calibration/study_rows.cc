#include "services/calibration/study_rows.h"

#include <google/protobuf/util/json_util.h>

#include <nlohmann/json.hpp>

#include "services/calibration/study_messages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::calibration {
namespace {

absl::StatusOr<std::string> JsonOf(const v1::Study& study) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto printed = google::protobuf::util::MessageToJsonString(study, &json, options);
  if (!printed.ok()) return absl::InternalError("study as JSON: " + std::string(printed.message()));
  return json;
}

}  // namespace

absl::StatusOr<runtime::Made<storage::StudyRow>> RecordOf(const v1::Study& study, std::string request_bytes) {
  storage::StudyRow row;
  row.study_id = storage::NewUuid();
  if (!study.machine().empty()) row.machine_id = runtime::LastSegment(study.machine());
  row.kind = KindText(study.kind());
  row.inputs.assign(study.inputs().begin(), study.inputs().end());
  row.request_bytes = std::move(request_bytes);
  row.verdict = VerdictText(study.verdict());
  row.software_version = study.software_version();
  if (study.environment().has_temperature_c()) row.temperature_c = study.environment().temperature_c();
  absl::StatusOr<std::string> json = JsonOf(study);
  if (!json.ok()) return json.status();
  row.result_json = *std::move(json);
  if (study.has_interim_check())
    row.interim_check = storage::InterimCheckRow{
        runtime::LastSegment(study.interim_check().sensor_calibration()), study.interim_check().clamping(),
        runtime::MomentOf(study.interim_check().scanned_at()), study.interim_check().limit_um()};
  storage::RecordEntry entry;
  entry.kind = "study";
  entry.name = runtime::NameOf("studies", row.study_id);
  entry.inputs = row.inputs;
  if (!row.machine_id.empty()) entry.machine = row.machine_id;
  entry.method = row.kind;
  entry.software_version = row.software_version;
  entry.summary_json = nlohmann::json{{"kind", row.kind}, {"verdict", row.verdict}}.dump();
  return runtime::Made<storage::StudyRow>{std::move(row), std::move(entry)};
}

}  // namespace sixpoint::calibration
