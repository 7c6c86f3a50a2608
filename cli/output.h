// What commands print: JSON for programs, text for people.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/timestamp.pb.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/table.h"
#include "sixpoint/geometry/v1/geometry.pb.h"

namespace sixpoint::cli {

void PrintJson(const nlohmann::json& json);
void PrintJson(const google::protobuf::Message& message);
// On one line, at once: results that a program reads as they come.
void PrintJsonLine(const nlohmann::json& json);
// As JSON, or as people read it.
void PrintMessage(bool as_json, const google::protobuf::Message& message, const std::function<std::string()>& text);

// A list, an array as JSON or a table, entry by entry.
class ListOutput {
 public:
  ListOutput(bool as_json, Table table);
  ~ListOutput();
  void Add(const google::protobuf::Message& entry, const std::function<Cells()>& cells);
  int count() const { return count_; }
  // none: what people read instead of an empty table.
  void Print(const std::string& none = "") const;

 private:
  const std::unique_ptr<nlohmann::json> json_;  // none: for people
  Table table_;
  int count_ = 0;
};

// "2026-11-21 03:25:01Z"; "-" when unset.
std::string TimeText(const google::protobuf::Timestamp& time);
std::string TimeText(std::chrono::system_clock::time_point moment);
// "2026-11-21", "2026-11-21 03:25:01Z" or RFC 3339; UTC where it names no zone. INVALID_ARGUMENT names the option.
absl::StatusOr<google::protobuf::Timestamp> TimeOf(const std::string& option, const std::string& text);
// "1.0000, 2.0000, 3.0000".
std::string PointText(const geometry::v1::Point& point, int decimals);
// "METHOD_SIX_POINT" without the enum's prefix, in small letters: "six-point".
std::string EnumText(const std::string& value_name, const std::string& prefix);
// "scans/s1" -> "s1".
std::string IdText(const std::string& resource_name);
// What a person typed, an id or the name that another command printed: "s1" or "scans/s1" -> "scans/s1".
std::string NameText(const std::string& collection, const std::string& id_or_name);
// A calibration of any kind: its name as another command printed it, or its id.
std::string CalibrationNameText(const std::string& id_or_name);

// The three numbers of an option; other counts are refused by its name. wanted: "X,Y,Z".
absl::StatusOr<std::array<double, 3>> ThreeOf(const std::string& option, const std::vector<double>& numbers,
                                              const std::string& wanted);

// What was scanned: "blade:SN-1" -> "blades/SN-1", "artefact:P" -> "artefacts/P"; a resource name is taken as it is.
// INVALID_ARGUMENT names the option.
absl::StatusOr<std::string> SubjectNameText(const std::string& option, const std::string& text);

}  // namespace sixpoint::cli
