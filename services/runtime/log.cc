#include "services/runtime/log.h"

#include <grpc/support/log.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

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
  if (args->severity == GPR_LOG_SEVERITY_DEBUG) return;
  Log(args->severity == GPR_LOG_SEVERITY_ERROR ? LogLevel::kError : LogLevel::kInfo, args->message,
      {{"from", std::string("grpc")}});
}

}  // namespace

void StartLog(const std::string& service) {
  ServiceName() = service;
  gpr_set_log_function(&LogFromGrpc);
}

void Log(LogLevel level, std::string_view message, const LogFields& fields) {
  nlohmann::ordered_json line;
  line["ts"] = NowText();
  line["level"] = level == LogLevel::kInfo ? "info" : level == LogLevel::kWarning ? "warning" : "error";
  line["service"] = ServiceName();
  line["version"] = SoftwareVersion();
  line["msg"] = message;
  for (const auto& [name, value] : fields) {
    std::visit([&line, &name = name](const auto& known) { line[name] = known; }, value);
  }
  // Bytes that are no UTF-8 come from outside; a log line must not fail on them.
  Sink().info(line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  Sink().flush();
}

}  // namespace sixpoint::runtime
