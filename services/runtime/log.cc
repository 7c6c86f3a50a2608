#include "services/runtime/log.h"

#include <grpc/support/log.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <vector>

#include "refusal/message_text.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/line_budget.h"
#include "services/runtime/server.h"

namespace sixpoint::runtime {
namespace {

std::string& ServiceName() {
  static std::string* const name = new std::string();
  return *name;
}

spdlog::logger& Sink() {
  static const std::shared_ptr<spdlog::logger> logger = [] {
    auto made = std::make_shared<spdlog::logger>("sixpoint", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    made->set_pattern("%v");
    return made;
  }();
  return *logger;
}

std::string NowText() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const auto since_epoch = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch());
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[48];
  std::snprintf(text, sizeof text, "%04d-%02d-%02dT%02d:%02d:%02d.%03dZ", utc.tm_year + 1900, utc.tm_mon + 1,
                utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, static_cast<int>(since_epoch.count() % 1000));
  return text;
}

void LogFromGrpc(gpr_log_func_args* args) {
  static LineBudget* const budget = new LineBudget();  // a handshake that fails is a line of gRPC's
  if (args->severity == GPR_LOG_SEVERITY_DEBUG || !budget->Take()) return;
  LogFields fields = {{"from", std::string("grpc")}};
  if (const long left_out_count = budget->TakeLeftOut(); left_out_count > 0)
    fields.emplace_back("messages_left_out_count", left_out_count);
  Log(args->severity == GPR_LOG_SEVERITY_ERROR ? LogLevel::kError : LogLevel::kInfo, args->message, fields);
}

// Each character that JSON escapes is two bytes at most, once a text is tame.
constexpr std::size_t kLongestBegin = 2 * kLongestLogText + 512, kMostLookedAt = 4 * kLongestLogText;

std::string Shown(std::string text) {
  text.resize(std::min(text.size(), kMostLookedAt));
  return Tame(WithoutSecrets(std::move(text)), kLongestLogText);
}

// Bytes that are no UTF-8 come from outside; a log line must not fail on them.
std::string JsonOf(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}
std::string JsonOf(const LogFields::value_type::second_type& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return JsonOf(nlohmann::ordered_json(Shown(*text)));
  if (const auto* json = std::get_if<JsonText>(&value)) return json->text;
  if (const auto* number = std::get_if<double>(&value)) return JsonOf(nlohmann::ordered_json(*number));
  return std::to_string(std::get<long>(value));
}

// One object, name by name; the first of a name counts. Written once: a plant logs every call.
class Line {
 public:
  bool Has(const std::string& name) const { return std::find(names_.begin(), names_.end(), name) != names_.end(); }
  void Add(const std::string& name, const std::string& json) {
    if (Has(name)) return;
    names_.push_back(name);
    text_ += (text_.empty() ? "{" : ",") + JsonOf(nlohmann::ordered_json(name)) + ":" + json;
  }
  std::string Text() const { return text_ + "}"; }

 private:
  std::vector<std::string> names_;
  std::string text_;
};

}  // namespace

void StartLog(const std::string& service) {
  ServiceName() = service;
  gpr_set_log_function(&LogFromGrpc);
}

const std::string& LoggedService() { return ServiceName(); }

void Log(LogLevel level, std::string_view message, const LogFields& fields) {
  const auto of_text = [](const std::string& text) { return JsonOf(nlohmann::ordered_json(text)); };
  Line line;
  line.Add("ts", of_text(NowText()));
  line.Add("level", level == LogLevel::kInfo ? "\"info\"" : level == LogLevel::kWarning ? "\"warning\"" : "\"error\"");
  line.Add("service", of_text(ServiceName()));
  line.Add("version", of_text(SoftwareVersion()));
  line.Add("msg", of_text(Shown(std::string(message.substr(0, kMostLookedAt)))));
  std::size_t size_bytes = 0, left_out_count = 0;
  const auto add = [&](const std::string& name, const std::string& json) {
    size_bytes += name.size() + json.size() + 4;
    if (size_bytes > kLongestLogLine - kLongestBegin)
      ++left_out_count;
    else
      line.Add(name, json);
  };
  for (const auto& [name, value] : fields) add(name, JsonOf(value));
  if (const auto call = CurrentCall())
    for (const auto& [name, value] : call->Known()) add(name, of_text(value));
  if (left_out_count > 0) line.Add("left_out_count", std::to_string(left_out_count));
  Sink().info(line.Text());
  Sink().flush();
}

}  // namespace sixpoint::runtime
