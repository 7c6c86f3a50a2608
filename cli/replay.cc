// `sixpoint replay NAME`: whether a recorded result comes out again with the same bits.
#include "cli/commands.h"
#include "services/runtime/errors.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/correction/v1/machining_pass.grpc.pb.h"
#include "sixpoint/correction/v1/reconstruction.grpc.pb.h"
#include "sixpoint/correction/v1/repair.grpc.pb.h"
#include "sixpoint/inspection/v1/assessment.grpc.pb.h"
#include "sixpoint/inspection/v1/deviation.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "sixpoint/inspection/v1/section.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using replay::v1::Replay;

constexpr char kReplayed[] =
    "registrations/ID, corrections/ID, inspections/ID, deviations/ID, sections/ID, reconstructions/ID, "
    "machining_passes/ID, repairs/ID or assessments/ID";

// "SAME_BITS", "SOFTWARE": the enums' names without their prefixes.
std::string OutcomeText(replay::v1::ReplayOutcome outcome) {
  return replay::v1::ReplayOutcome_Name(outcome).substr(std::string("REPLAY_OUTCOME_").size());
}
std::string KindText(replay::v1::DifferenceKind kind) {
  return replay::v1::DifferenceKind_Name(kind).substr(std::string("DIFFERENCE_KIND_").size());
}

// One row a result, and one each thing that is not as it was.
void AddRows(const Replay& replay, Table* table) {
  table->AddRow({replay.name(), OutcomeText(replay.outcome()), "", "", ""});
  for (const replay::v1::Difference& one : replay.differences())
    table->AddRow({"  differs: " + KindText(one.kind()), "", one.field(), one.recorded(), one.now()});
  for (const Replay& input : replay.inputs()) AddRows(input, table);
}

std::string ReplayText(const Replay& replay) {
  Table table({"result", "outcome", "field", "recorded", "now"});
  AddRows(replay, &table);
  std::string text = table.ToText();
  std::string taken;
  for (const std::string& field : replay.taken_as_recorded()) taken += (taken.empty() ? "" : ", ") + field;
  if (!taken.empty()) text += "as recorded, for it says how things stood then: " + taken + "\n";
  return text;
}

template <typename Service, typename Request>
absl::StatusOr<Replay> ReplayBy(Session* session, const std::string& area,
                                grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Replay*),
                                const std::string& name) {
  Request request;
  request.set_name(name);
  return CallAndPrint<Service>(session, area, method, request, ReplayText, "computing it again");
}

absl::StatusOr<Replay> ReplayOf(Session* session, const std::string& name) {
  const std::string collection = name.substr(0, name.find('/'));
  if (collection == "registrations")
    return ReplayBy<registration::v1::RegistrationService>(
        session, "registration", &registration::v1::RegistrationService::Stub::ReplayRegistration, name);
  if (collection == "corrections")
    return ReplayBy<correction::v1::CorrectionService>(
        session, "correction", &correction::v1::CorrectionService::Stub::ReplayCorrection, name);
  if (collection == "inspections")
    return ReplayBy<inspection::v1::InspectionService>(
        session, "inspection", &inspection::v1::InspectionService::Stub::ReplayInspection, name);
  if (collection == "deviations")
    return ReplayBy<inspection::v1::DeviationService>(
        session, "inspection", &inspection::v1::DeviationService::Stub::ReplayDeviationMap, name);
  if (collection == "sections")
    return ReplayBy<inspection::v1::SectionService>(
        session, "inspection", &inspection::v1::SectionService::Stub::ReplaySectionMeasurement, name);
  if (collection == "reconstructions")
    return ReplayBy<correction::v1::ReconstructionService>(
        session, "correction", &correction::v1::ReconstructionService::Stub::ReplayReconstruction, name);
  if (collection == "repairs")
    return ReplayBy<correction::v1::RepairService>(session, "correction",
                                                   &correction::v1::RepairService::Stub::ReplayRepair, name);
  if (collection == "machining_passes")
    return ReplayBy<correction::v1::MachiningPassService>(
        session, "correction", &correction::v1::MachiningPassService::Stub::ReplayMachiningPass, name);
  if (collection == "assessments")
    return ReplayBy<inspection::v1::AssessmentService>(
        session, "inspection", &inspection::v1::AssessmentService::Stub::ReplayAssessment, name);
  return runtime::Refuse("NAME", name, kReplayed);
}

}  // namespace

void AddReplayCommand(Command* app, Session* session) {
  const auto name = std::make_shared<std::string>();
  Command* replay =
      app->AddCommand("replay", "Computes a recorded result again from what it was computed from; 4: it differs");
  replay->AddOption("NAME", name.get(), kReplayed)->Required();
  session->OnCommand(replay, [session, name]() -> absl::Status {
    const absl::StatusOr<Replay> answer = ReplayOf(session, *name);
    if (!answer.ok()) return answer.status();
    if (answer->outcome() != replay::v1::REPLAY_OUTCOME_SAME_BITS) session->MarkNotUsable();
    return absl::OkStatus();
  });
}

}  // namespace sixpoint::cli
