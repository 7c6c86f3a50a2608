// `sixpoint recall NAME`: everything that rests on a thing, as the journal has it.

#include "cli/commands.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"

namespace sixpoint::cli {

using plant::v1::RecordService;

void AddRecallCommand(Command* app, Session* session) {
  struct Arguments {
    std::string name;
    std::vector<std::string> kinds;
    int limit = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* recall = app->AddCommand("recall", "Everything that was made, directly or not, from a thing");
  recall
      ->AddOption("NAME", &arguments->name, "As another command printed it: calibrations/ID, scans/ID, parts/ID@3, ...")
      ->Required();
  recall->AddOption("--kinds", &arguments->kinds, "Only these: registration,correction,...")->List();
  AddLimitOption(recall, &arguments->limit);
  session->OnCommand(recall, [session, arguments]() -> absl::Status {
    // An id alone may be of many things.
    if (arguments->name.find('/') == std::string::npos)
      return runtime::Refuse("NAME", arguments->name,
                             "a name with its collection, such as calibrations/ID or scans/ID");
    plant::v1::RecallRequest request;
    request.set_name(arguments->name);
    for (const std::string& kind : arguments->kinds) request.add_kinds(kind);
    return ListAndPrint<RecordService>(
        session, "plant", &RecordService::Stub::Recall, request, arguments->limit,
        Table({">sequence", "kind", "name", "blade", "method", "by", "recorded"}), &plant::v1::RecallResponse::entries,
        [](const plant::v1::RecordEntry& entry) {
          return Cells{std::to_string(entry.record_sequence()),
                       entry.kind(),
                       entry.name(),
                       entry.blade().empty() ? "-" : IdText(entry.blade()),
                       entry.method(),
                       entry.requested_by(),
                       TimeText(entry.recorded_at())};
        },
        "nothing rests on " + arguments->name + "\n");
  });
}

}  // namespace sixpoint::cli
