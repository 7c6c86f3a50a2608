#include "cli/output.h"

#include <google/protobuf/util/json_util.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <ctime>
#include <iostream>

#include "cli/number_format.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::cli {

nlohmann::json MessageToJson(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text, options).ok()) return nullptr;
  return nlohmann::json::parse(text, nullptr, false);
}

void PrintJson(const nlohmann::json& json) {
  std::cout << json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
}

void PrintMessage(bool as_json, const google::protobuf::Message& message, const std::function<std::string()>& text) {
  if (as_json) {
    PrintJson(MessageToJson(message));
  } else {
    std::cout << text();
  }
}

void PrintList(bool as_json, const nlohmann::json& json, const Table& table) {
  if (as_json) {
    PrintJson(json);
  } else {
    std::cout << table.ToText();
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

Progress::Progress(std::string label, std::string unit, std::int64_t total, bool quiet)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      total_(total),
      quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()),
      printed_(start_) {}

Progress::~Progress() { Print(true); }

void Progress::Add(std::int64_t count) {
  std::lock_guard<std::mutex> lock(mutex_);
  count_ += count;
  const auto interval = terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000);
  if (std::chrono::steady_clock::now() - printed_ > interval) Print(false);
}

std::string Progress::ToText(double seconds) const {
  const double share = total_ > 0 ? std::min(1.0, static_cast<double>(count_) / static_cast<double>(total_)) : 1.0;
  constexpr int kWidth = 24;
  const int filled = static_cast<int>(share * kWidth);
  const double rate = seconds > 0 ? static_cast<double>(count_) / seconds : 0;
  return label_ + " [" + std::string(filled, '#') + std::string(kWidth - filled, '.') + "] " + Fixed(100 * share, 0) +
         " %  " + Grouped(count_) + " of " + Grouped(total_) + " " + unit_ + ", " + Fixed(rate / 1e6, 2) + " M" +
         unit_ + "/s";
}

void Progress::Print(bool last) {
  if (quiet_) return;
  printed_ = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(printed_ - start_).count();
  std::cerr << (terminal_ ? "\r" : "") << ToText(seconds) << (last || !terminal_ ? "\n" : "") << std::flush;
}

}  // namespace sixpoint::cli
