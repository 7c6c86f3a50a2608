// `sixpoint recall NAME` and `sixpoint trace NAME`: what rests on a thing, and what a thing rests on, as the journal has it.

#include "cli/commands.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::RecordService;

Table EntryTable() {
  return Table({">sequence", "kind", "name", "blade", "method", "verdict", "state", "by", "recorded"});
}

Cells EntryCells(const plant::v1::RecordEntry& entry) {
  const auto or_dash = [](const std::string& text) { return text.empty() ? "-" : text; };
  return {std::to_string(entry.record_sequence()),
          entry.kind(),
          entry.name(),
          or_dash(IdText(entry.blade())),
          entry.method(),
          or_dash(entry.verdict()),
          or_dash(entry.state()),
          entry.requested_by(),
          TimeText(entry.recorded_at())};
}

// An id alone may be of many things.
absl::Status CheckCollection(const std::string& name) {
  if (name.find('/') != std::string::npos) return absl::OkStatus();
  return runtime::Refuse("NAME", name, "a name with its collection, such as calibrations/ID or scans/ID");
}

}  // namespace

void AddRecallCommand(Command* app, Session* session) {
  struct Arguments {
    std::string name, since, until;
    std::vector<std::string> kinds;
    int limit = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* recall = app->AddCommand("recall", "Everything that was made, directly or not, from a thing");
  recall->AddOption("NAME", &arguments->name,
                    "As another command printed it: calibrations/ID, scans/ID, parts/ID@3, ...; or sensors/SERIAL, "
                    "probes/SERIAL, software/VERSION; none: of everything since or until");
  AddKindsOption(recall, &arguments->kinds);
  recall->AddOption("--since", &arguments->since, "Only what was recorded then or later, and what was made from that");
  recall->AddOption("--until", &arguments->until, "Only what was recorded before, and what was made from that");
  AddLimitOption(recall, &arguments->limit);
  session->OnCommand(recall, [session, arguments]() -> absl::Status {
    const absl::StatusOr<list::v1::TimeRange> recorded = TimeRangeOf(arguments->since, arguments->until);
    if (!recorded.ok()) return recorded.status();
    const bool has_span = recorded->has_from() || recorded->has_until();
    if (!has_span || !arguments->name.empty())
      if (absl::Status status = CheckCollection(arguments->name); !status.ok()) return status;
    plant::v1::RecallRequest request;
    request.set_name(arguments->name);
    if (has_span) *request.mutable_recorded() = *recorded;
    for (const std::string& kind : arguments->kinds) request.add_kinds(kind);
    return ListAndPrint<RecordService>(
        session, "plant", &RecordService::Stub::Recall, request, arguments->limit, EntryTable(),
        &plant::v1::RecallResponse::entries, EntryCells,
        "nothing rests on " + (arguments->name.empty() ? "that span of time" : arguments->name) + "\n");
  });
}

void AddTraceCommand(Command* app, Session* session) {
  struct Arguments {
    std::string name;
    int limit = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* trace = app->AddCommand("trace", "Everything that a thing was made from; of a blade its whole genealogy");
  trace
      ->AddOption("NAME", &arguments->name,
                  "As another command printed it: blades/SERIAL, inspections/ID, parts/ID@3, ...")
      ->Required();
  AddLimitOption(trace, &arguments->limit);
  session->OnCommand(trace, [session, arguments]() -> absl::Status {
    if (absl::Status status = CheckCollection(arguments->name); !status.ok()) return status;
    plant::v1::TraceRequest request;
    request.set_name(arguments->name);
    return ListAndPrint<RecordService>(session, "plant", &RecordService::Stub::Trace, request, arguments->limit,
                                       EntryTable(), &plant::v1::TraceResponse::entries, EntryCells,
                                       arguments->name + " was made from nothing that is recorded\n");
  });
}

}  // namespace sixpoint::cli
