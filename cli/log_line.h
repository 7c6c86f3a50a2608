// One line of a plant's logs, whoever wrote it: a service (JSON), PostgreSQL, supervisord, or a program that ended before it had a log.
// What stands in a log may come from anywhere: nothing of it reaches a terminal as it is.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace sixpoint::cli {

struct LogLine {
  std::string source;  // plant, ingest, ..., watchdog, postgres, supervisord: whose file it is in
  std::optional<std::chrono::system_clock::time_point> time;
  std::string level;      // info, warning, error; empty: it says none, as what goes on from the line before
  std::string text;       // what is not JSON
  nlohmann::json fields;  // of a service's line, an object; else null
};

// What no line of ours is longer than; readers cut others.
inline constexpr std::size_t kLongestLine_bytes = 65536;

LogLine ParseLogLine(const std::string& source, std::string_view text);

// A field that is a text; empty: there is none.
std::string FieldText(const LogLine& line, const char* name);
// Of a line that tells a call (docs/logs.md): one that came in, or one that went out to another service.
bool IsCall(const LogLine& line);
bool IsOutgoingCall(const LogLine& line);

// In one row, safe for a terminal: "2026-11-23 07:20:43.123  info     ingest        ScanService/GetScan  OK  2.1 ms  users/jane".
std::string RowOf(const LogLine& line);
// "ScanService/GetScan" of "/sixpoint.ingest.v1.ScanService/GetScan".
std::string ShortRpc(const std::string& rpc);
// As a service's own line; what is of others has ts, level, service and msg. ASCII alone.
std::string JsonOf(const LogLine& line);

// Without control characters, and without those that turn the direction of what stands beside them.
std::string ForTerminal(std::string text);
std::string LogTimeText(std::chrono::system_clock::time_point time);

}  // namespace sixpoint::cli
