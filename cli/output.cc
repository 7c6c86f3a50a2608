#include "cli/output.h"

#include <google/protobuf/util/time_util.h>

#include <cctype>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/message_json.h"
#include "cli/number_format.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::cli {

void PrintJson(const nlohmann::json& json) {
  std::cout << json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
}

void PrintJson(const google::protobuf::Message& message) { PrintJson(MessageToJson(message)); }

void PrintJsonLine(const nlohmann::json& json) {
  std::cout << json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n" << std::flush;
}

void PrintMessage(bool as_json, const google::protobuf::Message& message, const std::function<std::string()>& text) {
  if (as_json) {
    PrintJson(message);
  } else {
    std::cout << text();
  }
}

ListOutput::ListOutput(bool as_json, Table table)
    : json_(as_json ? std::make_unique<nlohmann::json>(nlohmann::json::array()) : nullptr), table_(std::move(table)) {}
ListOutput::~ListOutput() = default;

void ListOutput::Add(const google::protobuf::Message& entry, const std::function<Cells()>& cells) {
  ++count_;
  json_ != nullptr ? json_->push_back(MessageToJson(entry)) : table_.AddRow(cells());
}

void ListOutput::Print(const std::string& none) const {
  if (json_ != nullptr) {
    PrintJson(*json_);
  } else {
    std::cout << (count_ == 0 && !none.empty() ? none : table_.ToText());
  }
}

std::string TimeText(const google::protobuf::Timestamp& time) {
  if (time.seconds() == 0) return "-";
  const std::time_t seconds = time.seconds();
  std::tm parts{};
  if (gmtime_r(&seconds, &parts) == nullptr) return "-";
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%SZ", &parts);
  return text;
}

std::string TimeText(std::chrono::system_clock::time_point moment) {
  google::protobuf::Timestamp time;
  runtime::ToProto(moment, &time);
  return TimeText(time);
}

absl::StatusOr<google::protobuf::Timestamp> TimeOf(const std::string& option, const std::string& text) {
  std::string whole = text;
  if (whole.size() == 10) whole += "T00:00:00";
  if (whole.size() > 10 && whole[10] == ' ') whole[10] = 'T';
  if (whole.size() == 19) whole += "Z";
  google::protobuf::Timestamp time;
  if (!google::protobuf::util::TimeUtil::FromString(whole, &time))
    return runtime::Refuse(option, text, "a time as 2026-11-21, 2026-11-21 03:25:01Z or RFC 3339 has it");
  return time;
}

std::string PointText(const geometry::v1::Point& point, int decimals) {
  return Fixed(point.x_mm(), decimals) + ", " + Fixed(point.y_mm(), decimals) + ", " + Fixed(point.z_mm(), decimals);
}

std::string EnumText(const std::string& value_name, const std::string& prefix) {
  std::string text = value_name.rfind(prefix, 0) == 0 ? value_name.substr(prefix.size()) : value_name;
  for (char& c : text) c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string IdText(const std::string& resource_name) {
  const std::size_t slash = resource_name.find('/');
  return slash == std::string::npos ? resource_name : resource_name.substr(slash + 1);
}

std::string NameText(const std::string& collection, const std::string& id_or_name) {
  const bool is_name = id_or_name.rfind(collection + "/", 0) == 0;
  return is_name ? id_or_name : runtime::NameOf(collection, id_or_name);
}

std::string CalibrationNameText(const std::string& id_or_name) {
  return id_or_name.find('/') != std::string::npos ? id_or_name : runtime::NameOf("calibrations", id_or_name);
}

absl::StatusOr<std::array<double, 3>> ThreeOf(const std::string& option, const std::vector<double>& numbers,
                                              const std::string& wanted) {
  if (numbers.size() != 3) return runtime::Refuse(option, std::to_string(numbers.size()) + " numbers", wanted);
  return std::array<double, 3>{numbers[0], numbers[1], numbers[2]};
}

absl::StatusOr<std::string> SubjectNameText(const std::string& option, const std::string& text) {
  if (text.rfind("blade:", 0) == 0) return NameText("blades", text.substr(6));
  if (text.rfind("artefact:", 0) == 0) return NameText("artefacts", text.substr(9));
  if (text.rfind("blades/", 0) == 0 || text.rfind("artefacts/", 0) == 0) return text;
  return runtime::Refuse(option, text, "blade:SERIAL or artefact:ID");
}

}  // namespace sixpoint::cli
