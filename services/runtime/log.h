// Logs: one JSON object a line to stderr (ts, level, service, version, msg, then the fields given). No payloads, no keys.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace sixpoint::runtime {

enum class LogLevel { kInfo, kWarning, kError };
using LogFields = std::vector<std::pair<std::string, std::variant<std::string, double, long>>>;

// Names the service in every line; once, at the start of main. Also takes over gRPC's own messages.
void StartLog(const std::string& service);
// Thread-safe.
void Log(LogLevel level, std::string_view message, const LogFields& fields = {});

}  // namespace sixpoint::runtime
