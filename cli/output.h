// What commands print: messages as JSON for programs, tables and progress for people.
#pragma once

#include <google/protobuf/message.h>
#include <google/protobuf/timestamp.pb.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/table.h"
#include "sixpoint/geometry/v1/geometry.pb.h"

namespace sixpoint::cli {

// The canonical JSON of a message, field names as in the proto files.
nlohmann::json MessageToJson(const google::protobuf::Message& message);
void PrintJson(const nlohmann::json& json);
// As JSON, or as people read it.
void PrintMessage(bool as_json, const google::protobuf::Message& message, const std::function<std::string()>& text);
// One of the two.
void PrintList(bool as_json, const nlohmann::json& json, const Table& table);

// "2026-11-21 03:25:01Z"; "-" when unset.
std::string TimeText(const google::protobuf::Timestamp& time);
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

// One line on stderr that counts up; a plain line now and then where stderr is no terminal. Thread-safe.
class Progress {
 public:
  // unit: what is counted, e.g. "points".
  Progress(std::string label, std::string unit, std::int64_t total, bool quiet);
  ~Progress();
  void Add(std::int64_t count);
  std::string ToText(double seconds) const;

 private:
  void Print(bool last);
  const std::string label_;
  const std::string unit_;
  const std::int64_t total_;
  const bool quiet_;
  const bool terminal_;
  const std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point printed_;
  std::int64_t count_ = 0;
  std::mutex mutex_;
};

}  // namespace sixpoint::cli
