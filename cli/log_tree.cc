#include "cli/log_tree.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

namespace sixpoint::cli {
namespace {

using nlohmann::json;
using std::chrono::system_clock;

double DurationMs(const LogLine& line) {
  const auto found = line.fields.find("dur_ms");
  return found != line.fields.end() && found->is_number() ? found->get<double>() : 0;
}

// A call's line is written at its end.
system_clock::time_point BeginOf(const LogLine& line) {
  const auto end = line.time.value_or(system_clock::time_point());
  return end - std::chrono::duration_cast<system_clock::duration>(
                   std::chrono::duration<double, std::milli>(std::clamp(DurationMs(line), 0.0, 1e9)));
}

std::string Ms(double ms) {
  char text[40];
  std::snprintf(text, sizeof text, "%10.1f ms", ms);
  return text;
}

double MsBetween(system_clock::time_point from, system_clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

}  // namespace

bool LogTree::Add(const LogLine& line) {
  if (lines_.size() == kMost) return false;
  lines_.push_back(line);
  return true;
}

std::vector<std::string> LogTree::TraceIds() const {
  std::set<std::string> ids;
  for (const LogLine& line : lines_) ids.insert(FieldText(line, "trace_id"));
  return {ids.begin(), ids.end()};
}

// Depth first, callees in the order in which they began.
std::vector<LogTree::Call> LogTree::Calls() const {
  std::vector<const LogLine*> spans;
  std::map<std::string, const LogLine*> by_id;
  for (const LogLine& line : lines_)
    if ((IsCall(line) || IsOutgoingCall(line)) && by_id.emplace(FieldText(line, "span_id"), &line).second)
      spans.push_back(&line);
  std::stable_sort(spans.begin(), spans.end(),
                   [](const LogLine* a, const LogLine* b) { return BeginOf(*a) < BeginOf(*b); });
  std::map<std::string, std::vector<const LogLine*>> below;
  std::vector<Call> open;
  for (const LogLine* const span : spans) {
    const std::string parent = FieldText(*span, "parent_span_id");
    if (by_id.count(parent) != 0 && parent != FieldText(*span, "span_id"))
      below[parent].push_back(span);
    else
      open.push_back({span, nullptr, 0});
  }
  std::reverse(open.begin(), open.end());
  std::vector<Call> calls;
  std::set<const LogLine*> reached;
  auto next = spans.begin();
  for (;;) {
    // Those whose parents lead back to themselves hang from no root: the first of them is made one.
    while (open.empty() && next != spans.end())
      if (const LogLine* const span = *next++; reached.count(span) == 0) open.push_back({span, nullptr, 0});
    if (open.empty()) break;
    Call call = open.back();
    open.pop_back();
    if (!reached.insert(call.line).second) continue;
    auto callees = below.find(FieldText(*call.line, "span_id"));
    if (IsOutgoingCall(*call.line) && callees != below.end() && callees->second.size() == 1 &&
        IsCall(*callees->second.front()) && reached.insert(callees->second.front()).second) {
      call.asked = call.line;
      call.line = callees->second.front();
      callees = below.find(FieldText(*call.line, "span_id"));
    }
    calls.push_back(call);
    if (callees == below.end()) continue;
    for (auto callee = callees->second.rbegin(); callee != callees->second.rend(); ++callee)
      open.push_back({*callee, nullptr, call.depth + 1});
  }
  return calls;
}

std::string LogTree::ToText() const {
  if (lines_.empty()) return "";
  const std::vector<Call> calls = Calls();
  auto first = lines_.front().time.value_or(system_clock::time_point());
  for (const LogLine& line : lines_) first = std::min(first, BeginOf(line));
  std::map<std::string, std::vector<const LogLine*>> said;  // by the span in which it was said
  std::set<std::string> known;
  for (const Call& call : calls) known.insert(FieldText(*call.line, "span_id"));
  std::string text = "trace " + ForTerminal(FieldText(lines_.front(), "trace_id")) + ", from " + LogTimeText(first) +
                     " UTC\n" + "      begins    took\n";
  const auto row = [&](system_clock::time_point at, const std::string& took, int depth, const std::string& what) {
    text += Ms(MsBetween(first, at)) + took + "  " +
            std::string(static_cast<std::size_t>(std::min(depth, 40)) * 2, ' ') + ForTerminal(what) + "\n";
  };
  for (const LogLine& line : lines_)
    if (!IsCall(line) && !IsOutgoingCall(line)) said[FieldText(line, "span_id")].push_back(&line);
  const auto say = [&](const std::string& span, int depth) {
    for (const LogLine* const line : said[span])
      row(line->time.value_or(first), std::string(13, ' '), depth,
          line->source + "  " + line->level + ": " + FieldText(*line, "msg"));
  };
  for (const Call& call : calls) {
    const LogLine& line = *call.line;
    std::string what = line.source + "  " + ShortRpc(FieldText(line, "rpc")) + "  " + FieldText(line, "code");
    if (IsOutgoingCall(line)) what += "  (asked by it; no answer of another is in these logs)";
    for (const char* name : {"caller", "machine", "blade", "scan"})
      if (const std::string value = FieldText(line, name); !value.empty()) what += "  " + value;
    if (call.asked != nullptr) {
      char waited[60];
      std::snprintf(waited, sizeof waited, "  (%.1f ms to who asked)", DurationMs(*call.asked));
      what += waited;
    }
    row(BeginOf(line), Ms(DurationMs(line)), call.depth, what);
    say(FieldText(line, "span_id"), call.depth + 1);
    if (call.asked != nullptr) say(FieldText(*call.asked, "span_id"), call.depth + 1);
  }
  for (const auto& [span, lines] : said)
    if (known.count(span) == 0) say(span, 0);  // of a call that has not ended, or whose line is gone
  return text;
}

json LogTree::ToJson() const {
  json calls = json::array(), lines = json::array();
  for (const Call& call : Calls()) {
    json entry = call.line->fields;
    entry.erase("resourceSpans");
    entry["depth"] = call.depth;
    entry["began_at"] = LogTimeText(BeginOf(*call.line)).replace(10, 1, "T") + "Z";
    if (call.asked != nullptr) entry["dur_ms_to_who_asked"] = DurationMs(*call.asked);
    calls.push_back(std::move(entry));
  }
  for (const LogLine& line : lines_)
    if (!IsCall(line) && !IsOutgoingCall(line)) lines.push_back(line.fields);
  const std::vector<std::string> ids = TraceIds();
  return {{"trace_id", ids.empty() ? "" : ids.front()}, {"calls", calls}, {"lines", lines}};
}

}  // namespace sixpoint::cli
