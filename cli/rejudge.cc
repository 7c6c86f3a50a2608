// `sixpoint rejudge`: recorded verdicts judged anew, one by one or all that rest on a thing, and which of them flip.
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "cli/commands.h"
#include "cli/message_json.h"
#include "cli/reports.h"
#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::InspectionService;
using inspection::v1::RejudgeRequest;
using inspection::v1::RejudgeResponse;

struct RejudgeArguments {
  std::string name, before, sensor_calibration, request_id;
};

std::string HolesText(const RejudgeResponse& one) {
  std::string text;
  for (const inspection::v1::FlippedHole& hole : one.flipped_holes())
    text += (text.empty() ? "" : ", ") + hole.group() + "/" + hole.hole() + " " + VerdictName(hole.now());
  return text;
}

// The answers of a call that may break off and go on: each old inspection once.
class Rejudged {
 public:
  explicit Rejudged(bool json) : json_(json), line_(json) {}

  void Take(const RejudgeResponse& one) {
    line_.Show("judged anew: " + std::to_string(one.finished_count()) + " of " + std::to_string(one.total_count()) +
               ", " + std::to_string(flip_count_ + one.flips()) + " flip");
    last_ = one.rejudged();
    if (!seen_.insert(one.rejudged()).second) return;
    if (json_) PrintJsonLine(MessageToJson(one));
    ++count_;
    if (one.has_refusal()) {
      ++refused_count_;
      flips_.AddRow({one.rejudged(), IdText(one.blade()), VerdictName(one.before()), "refused",
                     one.refusal().reason() + " " + one.refusal().message()});
      return;
    }
    flip_count_ += one.flips();
    if (one.flips() || !one.flipped_holes().empty())
      flips_.AddRow({one.rejudged(), IdText(one.blade()), VerdictName(one.before()),
                     VerdictName(one.inspection().verdict()), HolesText(one)});
  }
  std::size_t count() const { return count_; }
  const std::string& last() const { return last_; }  // empty: none
  int refused_count() const { return refused_count_; }
  void Print() {
    line_.Clear();
    if (json_) return;
    if (!flips_.empty()) std::cout << flips_.ToText();
    std::cout << count_ << " judged anew: " << flip_count_ << " flip, " << refused_count_ << " refused\n";
  }

 private:
  const bool json_;
  ProgressLine line_;
  Table flips_{{"inspection", "blade", "before", "now", "holes that flip"}};
  std::set<std::string> seen_;
  std::string last_;
  std::size_t count_ = 0;
  int flip_count_ = 0, refused_count_ = 0;
};

absl::StatusOr<RejudgeRequest> RequestOf(const RejudgeArguments& arguments) {
  RejudgeRequest request;
  if (arguments.name.rfind("inspections/", 0) == 0) {
    request.add_inspections(arguments.name);
  } else {
    request.set_recall(arguments.name);
    if (arguments.before.empty()) {
      // Whole seconds, as it is printed. What is recorded in the second that runs is not of before.
      runtime::ToProto(std::chrono::system_clock::now(), request.mutable_recorded_before());
      request.mutable_recorded_before()->clear_nanos();
    } else {
      const auto before = TimeOf("--before", arguments.before);
      if (!before.ok()) return before.status();
      *request.mutable_recorded_before() = *before;
    }
  }
  if (!arguments.sensor_calibration.empty())
    request.set_sensor_calibration(NameText("calibrations", arguments.sensor_calibration));
  request.set_request_id(arguments.request_id.empty() ? NewRequestId() : arguments.request_id);
  return request;
}

// Goes on by itself as long as it gets further.
absl::Status RunRejudge(Session* session, RejudgeRequest request, Rejudged* rejudged) {
  while (true) {
    const std::size_t before = rejudged->count();
    const absl::Status status = session->Retrying(
        "inspection", [&](const std::shared_ptr<grpc::Channel>& channel, std::unique_ptr<grpc::ClientContext> context) {
          request.set_after(rejudged->last());
          const auto stub = InspectionService::NewStub(channel);
          const auto reader = stub->Rejudge(context.get(), request);
          RejudgeResponse response;
          while (reader->Read(&response)) rejudged->Take(response);
          return runtime::FromGrpc(reader->Finish());
        });
    const bool broke_off = absl::IsDeadlineExceeded(status) || absl::IsUnavailable(status);
    if (!broke_off || rejudged->count() == before) return status;
  }
}

}  // namespace

void AddRejudgeCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<RejudgeArguments>();
  Command* command = app->AddCommand(
      "rejudge", "Judges recorded inspections anew, by what is in force now; each is a new inspection beside the old");
  command
      ->AddOption("NAME", &arguments->name,
                  "inspections/ID; or all that rest on a thing, named as in recall: calibrations/ID, machines/ID, ...")
      ->Required();
  command->AddOption("--before", &arguments->before, "Only those recorded before then; without it before now");
  command->AddOption("--sensor-calibration", &arguments->sensor_calibration,
                     "Maps the scans by it; without it by the one that was in force when they were received");
  command->AddOption("--request-id", &arguments->request_id, "Goes on with one that broke off, with its --before");
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    const absl::StatusOr<RejudgeRequest> request = RequestOf(*arguments);
    if (!request.ok()) return request.status();
    if (!session->json)
      std::cerr << "rejudge " << request->request_id() << "; should it break off: the same command with --request-id"
                << (request->has_recorded_before()
                        ? " and --before '" + TimeText(request->recorded_before()) + "' goes on\n"
                        : " goes on\n");
    Rejudged rejudged(session->json);
    const absl::Status status = RunRejudge(session, *request, &rejudged);
    rejudged.Print();
    if (status.ok() && rejudged.refused_count() > 0) session->MarkNotUsable();
    return status;
  });
}

}  // namespace sixpoint::cli
