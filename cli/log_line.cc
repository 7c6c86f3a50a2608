#include "cli/log_line.h"

#include <array>
#include <cctype>
#include <cstdio>
#include <ctime>
#include <utility>

#include "refusal/message_text.h"

namespace sixpoint::cli {
namespace {

using nlohmann::json;
using std::chrono::system_clock;

// What a row shows at its own place, or not at all.
constexpr std::array<const char*, 11> kPlaced = {"ts",  "level",    "service",      "version",
                                                 "msg", "trace_id", "span_id",      "parent_span_id",
                                                 "rpc", "dur_ms",   "resourceSpans"};

// "2026-11-23T07:20:43.123": date, any character, time, a point or comma and three digits; none where it is not that.
std::optional<std::pair<std::tm, int>> ReadTime(std::string_view text) {
  std::tm read{};
  int ms = 0, used = 0;
  const std::string begin(text.substr(0, 23));
  if (begin.size() < 23 ||
      std::sscanf(begin.c_str(), "%4d-%2d-%2d%*c%2d:%2d:%2d%*1[.,]%3d%n", &read.tm_year, &read.tm_mon, &read.tm_mday,
                  &read.tm_hour, &read.tm_min, &read.tm_sec, &ms, &used) != 7 ||
      used != 23)
    return std::nullopt;
  const bool possible = read.tm_year >= 1970 && read.tm_year < 9999 && read.tm_mon >= 1 && read.tm_mon <= 12 &&
                        read.tm_mday >= 1 && read.tm_mday <= 31 && read.tm_hour >= 0 && read.tm_hour < 24 &&
                        read.tm_min >= 0 && read.tm_min < 60 && read.tm_sec >= 0 && read.tm_sec <= 60 && ms >= 0;
  if (!possible) return std::nullopt;
  read.tm_year -= 1900;
  read.tm_mon -= 1;
  return std::pair(read, ms);
}

std::optional<system_clock::time_point> LogTimeOf(std::string_view text, bool is_utc) {
  auto read = ReadTime(text);
  if (!read) return std::nullopt;
  read->first.tm_isdst = -1;
  const std::time_t seconds = is_utc ? timegm(&read->first) : mktime(&read->first);
  return system_clock::from_time_t(seconds) + std::chrono::milliseconds(read->second);
}

// "2026-11-23 07:20:43.123 UTC [815] LOG:  database system is ready"; details go on from the line before.
LogLine FromPostgres(std::string_view text) {
  LogLine line;
  const std::size_t zone_end = text.find(' ', 24), pid_end = text.find("] ", 24);
  if (zone_end == std::string_view::npos || pid_end == std::string_view::npos || text.substr(zone_end, 2) != " [")
    return line;
  const std::string_view zone = text.substr(24, zone_end - 24);
  line.time = LogTimeOf(text, zone == "UTC" || zone == "GMT");
  if (!line.time) return line;
  line.text = text.substr(pid_end + 2);
  const std::string word = line.text.substr(0, line.text.find(':'));
  // "user@database ERROR:  ..." where its prefix names them
  const std::string severity = word.substr(word.rfind(' ') + 1);
  if (severity == "WARNING") line.level = "warning";
  if (severity == "ERROR" || severity == "FATAL" || severity == "PANIC") line.level = "error";
  if (severity == "LOG" || severity == "INFO" || severity == "NOTICE") line.level = "info";
  return line;
}

// "2026-11-23 07:20:43,123 INFO spawned: 'ingest' with pid 815", in the computer's own time.
LogLine FromSupervisor(std::string_view text) {
  LogLine line;
  line.time = LogTimeOf(text, /*is_utc=*/false);
  if (!line.time || text.size() < 25) return line;
  const std::string_view rest = text.substr(24);
  const std::size_t blank = rest.find(' ');
  const std::string_view word = rest.substr(0, blank);
  line.level = word == "CRIT" || word == "ERRO" ? "error" : word == "WARN" ? "warning" : "info";
  line.text = blank == std::string_view::npos ? "" : rest.substr(blank + 1);
  return line;
}

std::string ValueText(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string DurationText(const json& fields) {
  const auto found = fields.find("dur_ms");
  if (found == fields.end() || !found->is_number()) return "";
  char text[40];
  std::snprintf(text, sizeof text, "%.1f ms", found->get<double>());
  return text;
}

std::string CallText(const LogLine& line) {
  std::string text =
      ShortRpc(FieldText(line, "rpc")) + "  " + FieldText(line, "code") + "  " + DurationText(line.fields);
  for (const char* name : {"caller", "machine", "blade", "scan"})
    if (const std::string value = FieldText(line, name); !value.empty()) text += "  " + value;
  return text;
}

std::string MessageText(const LogLine& line) {
  std::string text = FieldText(line, "msg");
  for (const auto& [name, value] : line.fields.items()) {
    bool placed = false;
    for (const char* known : kPlaced) placed = placed || name == known;
    if (!placed) text += "  " + name + "=" + ValueText(value);
  }
  return text;
}

std::string Padded(std::string text, std::size_t width) {
  if (text.size() < width) text.resize(width, ' ');
  return text;
}

}  // namespace

LogLine ParseLogLine(const std::string& source, std::string_view text) {
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  LogLine line;
  if (!text.empty() && text[0] == '{') {
    line.fields = json::parse(text.begin(), text.end(), nullptr, false);
    if (!line.fields.is_object()) line.fields = nullptr;
  }
  if (line.fields.is_object()) {
    const std::string time = FieldText(line, "ts");
    if (time.size() == 24 && time.back() == 'Z') line.time = LogTimeOf(time, /*is_utc=*/true);
    line.level = FieldText(line, "level");
  } else if (source == "postgres") {
    line = FromPostgres(text);
  } else if (source == "supervisord") {
    line = FromSupervisor(text);
  }
  if (!line.fields.is_object() && !line.time) line.text = text;
  line.source = source;
  return line;
}

std::string FieldText(const LogLine& line, const char* name) {
  if (!line.fields.is_object()) return "";
  const auto found = line.fields.find(name);
  return found != line.fields.end() && found->is_string() ? found->get<std::string>() : "";
}

bool IsCall(const LogLine& line) { return FieldText(line, "msg") == "call" && !FieldText(line, "rpc").empty(); }
bool IsOutgoingCall(const LogLine& line) {
  return FieldText(line, "msg") == "called" && !FieldText(line, "rpc").empty();
}

std::string ShortRpc(const std::string& rpc) {
  const std::size_t slash = rpc.rfind('/');
  if (slash == std::string::npos || slash == 0) return rpc;
  const std::size_t point = rpc.rfind('.', slash);
  return point == std::string::npos ? rpc.substr(1) : rpc.substr(point + 1);
}

std::string RowOf(const LogLine& line) {
  std::string text = line.text;
  if (line.fields.is_object()) text = IsCall(line) || IsOutgoingCall(line) ? CallText(line) : MessageText(line);
  if (const std::string trace = FieldText(line, "trace_id"); !trace.empty()) text += "  trace=" + trace;
  const std::string time = line.time ? LogTimeText(*line.time) : std::string(23, ' ');
  return ForTerminal(time + "  " + Padded(line.level, 7) + "  " + Padded(line.source, 12) + "  " + text);
}

std::string JsonOf(const LogLine& line) {
  nlohmann::json object = line.fields;
  if (!object.is_object()) {
    object = {{"level", line.level}, {"service", line.source}, {"msg", line.text}};
    if (line.time) {
      std::string time = LogTimeText(*line.time);
      time[10] = 'T';
      object["ts"] = time + "Z";
    }
  }
  return object.dump(-1, ' ', /*ensure_ascii=*/true, json::error_handler_t::replace);
}

// Hides what turns the direction of what comes after it (Unicode's Bidi_Control).
std::string ForTerminal(std::string text) {
  text = Tame(std::move(text), kLongestLine_bytes);
  const std::string arabic_letter_mark = "\xd8\x9c";
  for (std::size_t at = 0; (at = text.find(arabic_letter_mark, at)) != std::string::npos; ++at)
    text.replace(at, arabic_letter_mark.size(), "?");
  for (std::size_t at = 0; (at = text.find('\xe2', at)) != std::string::npos; ++at) {
    const std::string_view character(text.data() + at, 3);
    const auto last = static_cast<unsigned char>(character[2]);
    const bool turns = (character[1] == '\x80' && (last == 0x8e || last == 0x8f || (last >= 0xa8 && last <= 0xae))) ||
                       (character[1] == '\x81' && last >= 0xa6 && last <= 0xa9);
    if (turns) text.replace(at, 3, "?");
  }
  return text;
}

std::string LogTimeText(system_clock::time_point time) {
  const std::time_t seconds = system_clock::to_time_t(time);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count() % 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[48];
  std::snprintf(text, sizeof text, "%04d-%02d-%02d %02d:%02d:%02d.%03d", utc.tm_year + 1900, utc.tm_mon + 1,
                utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, static_cast<int>(ms));
  return text;
}

}  // namespace sixpoint::cli
