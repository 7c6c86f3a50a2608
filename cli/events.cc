// `sixpoint events`: what the plant records, as it records it.
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/message_json.h"
#include "services/runtime/cloud_event.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/event.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::Event;
using plant::v1::EventService;

struct EventsArguments {
  std::int64_t after = -1;  // -1: not given
  std::vector<std::string> kinds, verdicts;
  std::string machine, blade, part;
  bool follow = false, cloud_events = false;
};

plant::v1::EventFilter FilterOf(const EventsArguments& arguments) {
  plant::v1::EventFilter filter;
  const auto name = [](const char* collection, const std::string& id) {
    return id.empty() ? id : NameText(collection, id);
  };
  for (const std::string& kind : arguments.kinds) filter.add_kinds(kind);
  for (const std::string& verdict : arguments.verdicts) filter.add_verdicts(verdict);
  filter.set_machine(name("machines", arguments.machine));
  filter.set_blade(name("blades", arguments.blade));
  filter.set_part(name("parts", arguments.part));
  return filter;
}

// A line each, at once, and each once: what a call that is made again tells a second time is not printed.
class EventPrinter {
 public:
  EventPrinter(bool as_json, bool as_cloud_events) : as_json_(as_json), as_cloud_events_(as_cloud_events) {}

  void Print(const Event& event, const std::string& source) {
    const plant::v1::RecordEntry& entry = event.entry();
    if (entry.record_sequence() <= last_sequence_) return;
    last_sequence_ = entry.record_sequence();
    if (as_cloud_events_) return PrintJsonLine(runtime::CloudEventOf(event, source));
    if (as_json_) return PrintJsonLine(MessageToJson(event));
    if (!has_printed_) PrintLine("sequence", "recorded", "kind", "verdict/state", "blade", "name");
    has_printed_ = true;
    PrintLine(std::to_string(entry.record_sequence()), TimeText(entry.recorded_at()), entry.kind(),
              entry.verdict().empty() ? entry.state() : entry.verdict(), IdText(entry.blade()), entry.name());
  }
  bool has_printed() const { return last_sequence_ > 0; }

 private:
  static void PrintLine(const std::string& sequence, const std::string& recorded, const std::string& kind,
                        const std::string& verdict, const std::string& blade, const std::string& name) {
    const auto or_dash = [](const std::string& text) { return text.empty() ? "-" : text.c_str(); };
    char line[512];
    std::snprintf(line, sizeof line, "%10s  %-20s  %-12s  %-14s  %-20s  %s", sequence.c_str(), recorded.c_str(),
                  kind.c_str(), or_dash(verdict), or_dash(blade), name.c_str());
    std::cout << line << "\n" << std::flush;
  }

  const bool as_json_, as_cloud_events_;
  std::int64_t last_sequence_ = 0;
  bool has_printed_ = false;  // the heads of the columns
};

absl::Status ListAll(Session* session, const EventsArguments& arguments, EventPrinter* printer) {
  plant::v1::ListEventsRequest request;
  *request.mutable_filter() = FilterOf(arguments);
  request.set_after_sequence(std::max<std::int64_t>(arguments.after, 0));
  request.set_page_size(1000);
  plant::v1::ListEventsResponse page;
  do {
    const absl::Status listed = session->Call<EventService>("plant", &EventService::Stub::ListEvents, request, &page);
    if (!listed.ok()) return listed;
    for (const Event& event : page.events()) printer->Print(event, page.source());
    request.set_after_sequence(page.looked_at_sequence());
  } while (!page.is_newest() && std::cout);
  if (!printer->has_printed() && !session->json && !arguments.cloud_events) std::cout << "no events\n";
  return absl::OkStatus();
}

// For ever: a call that ends goes on where it broke off.
absl::Status Follow(Session* session, const EventsArguments& arguments, EventPrinter* printer) {
  plant::v1::WatchEventsRequest request;
  *request.mutable_filter() = FilterOf(arguments);
  request.set_after_sequence(std::max<std::int64_t>(arguments.after, 0));
  request.set_from_now(arguments.after < 0);
  return session->Following(
      "plant", [&](const std::shared_ptr<grpc::Channel>& channel, std::unique_ptr<grpc::ClientContext> context,
                   const std::function<void()>& progressed) {
        const auto stub = EventService::NewStub(channel);
        const auto reader = stub->WatchEvents(context.get(), request);
        plant::v1::WatchEventsResponse response;
        while (std::cout && reader->Read(&response)) {
          progressed();
          for (const Event& event : response.events()) printer->Print(event, response.source());
          request.set_after_sequence(response.looked_at_sequence());
          request.set_from_now(false);
        }
        if (!std::cout) context->TryCancel();
        const absl::Status ended = runtime::FromGrpc(reader->Finish());
        return std::cout ? ended : absl::OkStatus();
      });
}

}  // namespace

void AddEventsCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<EventsArguments>();
  Command* const command = app->AddCommand(
      "events", "What the plant recorded, oldest first; with --follow also what it records from now on");
  const Option* const after = command->AddOption(
      "--after", &arguments->after,
      "Only past this number: that of the last event that was read. Without it all, or with --follow "
      "what comes from now on");
  AddKindsOption(command, &arguments->kinds);
  command->AddOption("--verdicts", &arguments->verdicts, "Only with one of these: NOT_CONFORM,UNDECIDABLE,...")->List();
  command->AddOption("--machine", &arguments->machine, "Only of this machine");
  command->AddOption("--blade", &arguments->blade, "Only of this blade: its serial number");
  command->AddOption("--part", &arguments->part, "Only of this part, its blades and what is recorded of them");
  command->AddFlag("--follow", &arguments->follow,
                   "Go on with what comes, until it is ended; also after a crash of the plant, each event once");
  command->AddFlag("--cloudevents", &arguments->cloud_events, "As CloudEvents 1.0, a JSON object a line");
  session->OnCommand(command, [session, arguments, after]() -> absl::Status {
    if (after->given() && arguments->after < 0)
      return runtime::Refuse("--after", std::to_string(arguments->after), "the number of an event, or 0");
    EventPrinter printer(session->json, arguments->cloud_events);
    return arguments->follow ? Follow(session, *arguments, &printer) : ListAll(session, *arguments, &printer);
  });
}

}  // namespace sixpoint::cli
