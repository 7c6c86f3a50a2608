// `sixpoint logs`: what a plant on this machine wrote, all programs together, in the order of time.
#include <algorithm>
#include <cctype>
#include <deque>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "cli/commands.h"
#include "cli/local_plant.h"
#include "cli/log_files.h"
#include "cli/log_tree.h"
#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/trace.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using std::chrono::system_clock;

constexpr std::chrono::milliseconds kBetweenLooks{200};
constexpr int kUsualLines = 200, kMostLogLines = 1'000'000;
constexpr std::size_t kShortestTrace = 8, kTrace = 32;

struct LogsArguments {
  std::vector<std::string> areas;
  bool follow = false;
  std::string since, level = "info", trace, machine, blade, scan;
  int lines = kUsualLines;
  Option* lines_option = nullptr;
};

const std::vector<std::string>& Sources() {
  static const auto* const sources = [] {
    auto* all = new std::vector<std::string>(kAreas.begin(), kAreas.end());
    for (const char* other : {kGateway, "watchdog", "postgres", "supervisord"}) all->emplace_back(other);
    return all;
  }();
  return *sources;
}

int LevelNumber(const std::string& level) { return level == "error" ? 2 : level == "warning" ? 1 : 0; }

// What a line must be to be shown.
struct LogFilter {
  int level = 0;
  std::optional<system_clock::time_point> since;
  std::string trace, machine, blade, scan;

  bool IsOfOneThing() const { return !trace.empty() || !machine.empty() || !blade.empty() || !scan.empty(); }
  bool Takes(const LogLine& line) const {
    if (since && line.time && *line.time < *since) return false;
    // A line without a level is what a program said that had no log: never hidden for it.
    if (!line.level.empty() && LevelNumber(line.level) < level) return false;
    for (const auto& [name, wanted] :
         {std::pair("machine", &machine), std::pair("blade", &blade), std::pair("scan", &scan)})
      if (!wanted->empty() && FieldText(line, name) != *wanted) return false;
    return trace.empty() || FieldText(line, "trace_id").rfind(trace, 0) == 0;
  }
};

// "10m", "2h", "3d" before now, or a time.
absl::StatusOr<system_clock::time_point> SinceOf(const std::string& text) {
  const std::size_t digits = text.find_first_not_of("0123456789");
  if (digits != std::string::npos && digits > 0 && digits <= 6 && digits + 1 == text.size()) {
    const long count = std::stol(text);
    switch (text.back()) {
      case 's':
        return system_clock::now() - std::chrono::seconds(count);
      case 'm':
        return system_clock::now() - std::chrono::minutes(count);
      case 'h':
        return system_clock::now() - std::chrono::hours(count);
      case 'd':
        return system_clock::now() - std::chrono::hours(24 * count);
      default:
        break;
    }
  }
  const absl::StatusOr<google::protobuf::Timestamp> time = TimeOf("--since", text);
  if (!time.ok())
    return runtime::Refuse("--since", text, "a time as 2026-11-21 or 2026-11-21 03:25:01Z, or 90s, 10m, 2h, 3d");
  return system_clock::from_time_t(time->seconds()) + std::chrono::milliseconds(time->nanos() / 1'000'000);
}

// Its id, or the beginning of one; a whole traceparent is taken too.
absl::StatusOr<std::string> TraceOf(const std::string& text) {
  if (text.empty()) return text;
  if (const std::string id = runtime::TraceIdOf(text); !id.empty()) return id;
  const bool is_hex = std::all_of(text.begin(), text.end(),
                                  [](unsigned char c) { return std::isdigit(c) != 0 || (c >= 'a' && c <= 'f'); });
  if (is_hex && text.size() >= kShortestTrace && text.size() <= kTrace) return text;
  return runtime::Refuse("--trace", text, "a trace's id of 32 digits 0-9a-f, or its first 8 or more");
}

absl::StatusOr<LogFilter> FilterOf(const LogsArguments& arguments) {
  LogFilter filter;
  filter.level = LevelNumber(arguments.level);
  if (!arguments.since.empty()) {
    const auto since = SinceOf(arguments.since);
    if (!since.ok()) return since.status();
    filter.since = *since;
  }
  absl::StatusOr<std::string> trace = TraceOf(arguments.trace);
  if (!trace.ok()) return trace.status();
  filter.trace = *std::move(trace);
  if (!arguments.machine.empty()) filter.machine = NameText("machines", arguments.machine);
  if (!arguments.blade.empty()) filter.blade = NameText("blades", arguments.blade);
  if (!arguments.scan.empty()) filter.scan = NameText("scans", arguments.scan);
  return filter;
}

// Calls that a service made are its callee's lines too: people see them in a trace.
bool Print(const Session& session, const LogLine& line) {
  if (session.json) {
    std::cout << JsonOf(line) << "\n";
  } else if (!IsOutgoingCall(line)) {
    std::cout << RowOf(line) << "\n";
  }
  return std::cout.good();
}

// The tree of one trace.
absl::Status PrintTrace(Session* session, const LogFilter& filter, std::vector<LogFile>* files) {
  LogTree tree;
  bool whole = true;
  ForEachLogLine(files, /*half_lines=*/true,
                 [&](const LogLine& line) { return !filter.Takes(line) || (whole = tree.Add(line)); });
  const std::vector<std::string> ids = tree.TraceIds();
  if (ids.empty())
    return absl::NotFoundError("--trace: " + filter.trace + ", want one of which these logs still have a line");
  if (ids.size() > 1)
    return runtime::Refuse("--trace", filter.trace + ", the beginning of " + std::to_string(ids.size()) + " traces",
                           "more digits: " + ForTerminal(ids[0]) + " or " + ForTerminal(ids[1]));
  if (session->json) {
    PrintJson(tree.ToJson());
  } else {
    std::cout << tree.ToText();
  }
  if (!whole) std::cerr << "only the first " << LogTree::kMost << " lines of this trace were looked at\n";
  return absl::OkStatus();
}

// The last ones, then what comes, for as long as somebody reads.
void PrintLines(const Session& session, const LogFilter& filter, int most, bool follow, std::vector<LogFile>* files) {
  std::deque<LogLine> last;
  ForEachLogLine(files, /*half_lines=*/!follow, [&](const LogLine& line) {
    if (!filter.Takes(line)) return true;
    if (most == 0) return Print(session, line);
    if (!session.json && IsOutgoingCall(line)) return true;
    last.push_back(line);
    if (last.size() > static_cast<std::size_t>(most)) last.pop_front();
    return true;
  });
  for (const LogLine& line : last)
    if (!Print(session, line)) return;
  std::set<std::string> told;
  while (follow && std::cout.flush()) {
    for (const LogFile& file : *files)
      if (file.has_lost() && told.insert(file.source()).second)
        std::cerr << file.source() << ".log was moved on faster than it was read: lines are missing here\n";
    std::this_thread::sleep_for(kBetweenLooks);
    ForEachLogLine(files, /*half_lines=*/false,
                   [&](const LogLine& line) { return !filter.Takes(line) || Print(session, line); });
  }
}

absl::Status Logs(Session* session, const LogsArguments& arguments) {
  const absl::StatusOr<LocalPlant> plant = KnownPlant(session->data);
  if (!plant.ok()) return plant.status();
  const absl::StatusOr<LogFilter> filter = FilterOf(arguments);
  if (!filter.ok()) return filter.status();
  LogStart start;
  start.since = filter->since;
  const bool all = filter->IsOfOneThing() || filter->since.has_value() || filter->level > 0;
  const int most = arguments.lines_option->given() || !all ? arguments.lines : 0;
  // No line is longer than that, so that the last ones are within it.
  if (!all && most > 0) start.last_bytes = static_cast<std::int64_t>(most) * static_cast<int>(kLongestLine_bytes);
  std::vector<LogFile> files =
      LogFilesIn(plant->logs(), arguments.areas.empty() ? Sources() : arguments.areas, FindServiceUser().uid, start);
  if (!filter->trace.empty() && !arguments.follow) return PrintTrace(session, *filter, &files);
  PrintLines(*session, *filter, most, arguments.follow, &files);
  return absl::OkStatus();
}

}  // namespace

void AddLogsCommand(Command* app, Session* session) {
  Command* const logs = app->AddCommand("logs", "What the plant on this machine wrote, all programs in order of time");
  const auto arguments = std::make_shared<LogsArguments>();
  logs->AddOption("AREA", &arguments->areas, "Only these: a service, watchdog, postgres or supervisord")
      ->OneOf(Sources());
  logs->AddFlag("-f,--follow", &arguments->follow, "Goes on with what comes, until it is stopped");
  logs->AddOption("--since", &arguments->since, "A time, or so long ago: 90s, 10m, 2h, 3d");
  logs->AddOption("--level", &arguments->level, "That and above: info, warning, error")
      ->OneOf({"info", "warning", "error"})
      ->ShowDefault();
  logs->AddOption("--trace", &arguments->trace, "One trace, as a tree of its calls (with --follow: its lines)");
  logs->AddOption("--machine", &arguments->machine, "Only what concerns it");
  logs->AddOption("--blade", &arguments->blade, "Only what concerns it");
  logs->AddOption("--scan", &arguments->scan, "Only what concerns it");
  arguments->lines_option = logs->AddOption("-n,--lines", &arguments->lines,
                                            "The last so many; 0: all, as without it where something else says which")
                                ->Within(0, kMostLogLines)
                                ->ShowDefault();
  session->OnCommand(logs, [session, arguments] { return Logs(session, *arguments); });
}

}  // namespace sixpoint::cli
