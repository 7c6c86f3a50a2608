// Logs: one JSON object a line to stderr (docs/logs.md): ts, level, service, version, msg, then the fields given, and of the call that the
// thread works for its trace and what is known of it (call_scope.h). No payloads, no keys: what looks like one is hidden all the same.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace sixpoint::runtime {

enum class LogLevel { kInfo, kWarning, kError };
// JSON as it stands, of our own making.
struct JsonText {
  std::string text;
};
using LogFields = std::vector<std::pair<std::string, std::variant<std::string, double, long, JsonText>>>;

// A message or a field is cut at so many bytes, a line holds no more than this.
inline constexpr std::size_t kLongestLogText = 2000, kLongestLogLine = 16384;

// Names the service in every line; once, at the start of main. Also takes over gRPC's own messages.
void StartLog(const std::string& service);
// Empty where StartLog was not called: in a program that is no service.
const std::string& LoggedService();
// Thread-safe.
void Log(LogLevel level, std::string_view message, const LogFields& fields = {});

// Without what is nobody's to read: private keys in PEM, values of password=, passwords in URLs.
std::string WithoutSecrets(std::string text);

}  // namespace sixpoint::runtime
