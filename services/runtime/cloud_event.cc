#include "services/runtime/cloud_event.h"

#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>

#include <cstdio>
#include <nlohmann/json.hpp>

namespace sixpoint::runtime {
namespace {

using google::protobuf::util::TimeUtil;

// What is empty is not there.
void Set(const char* key, const std::string& text, nlohmann::json* data) {
  if (!text.empty()) (*data)[key] = text;
}

nlohmann::json DataOf(const plant::v1::Event& event) {
  const plant::v1::RecordEntry& entry = event.entry();
  nlohmann::json data = {
      {"record_sequence", entry.record_sequence()},
      {"kind", entry.kind()},
      {"name", entry.name()},
      {"recorded_at", TimeUtil::ToString(entry.recorded_at())},
      {"inputs", nlohmann::json(std::vector<std::string>(entry.inputs().begin(), entry.inputs().end()))}};
  Set("blade", entry.blade(), &data);
  Set("machine", entry.machine(), &data);
  Set("method", entry.method(), &data);
  Set("verdict", entry.verdict(), &data);
  Set("state", entry.state(), &data);
  Set("requested_by", entry.requested_by(), &data);
  Set("software_version", entry.software_version(), &data);
  Set("trace_id", entry.trace_id(), &data);
  if (entry.has_measured_at()) data["measured_at"] = TimeUtil::ToString(entry.measured_at());
  if (event.has_valid_until()) data["valid_until"] = TimeUtil::ToString(event.valid_until());
  std::string summary;
  if (entry.has_summary() && google::protobuf::util::MessageToJsonString(entry.summary(), &summary).ok())
    data["summary"] = nlohmann::json::parse(summary, nullptr, /*allow_exceptions=*/false);
  return data;
}

// Texts of this extension are compared letter by letter.
std::string SequenceText(std::int64_t sequence) {
  char text[24];
  std::snprintf(text, sizeof text, "%019lld", static_cast<long long>(sequence));
  return text;
}

}  // namespace

nlohmann::json CloudEventOf(const plant::v1::Event& event, const std::string& source) {
  const plant::v1::RecordEntry& entry = event.entry();
  return {{"specversion", "1.0"},
          {"id", std::to_string(entry.record_sequence())},
          {"source", source},
          {"type", "sixpoint." + entry.kind() + ".recorded"},
          {"subject", entry.name()},
          {"time", TimeUtil::ToString(entry.recorded_at())},
          {"sequence", SequenceText(entry.record_sequence())},
          {"datacontenttype", "application/json"},
          {"dataschema", kEventSchema},
          {"data", DataOf(event)}};
}

}  // namespace sixpoint::runtime
