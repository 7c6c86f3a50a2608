// `sixpoint assess`: a blade against its drawing, from results that there are or from scans, by all that the drawing asks for.
#include <map>

#include "cli/assessment_report.h"
#include "cli/commands.h"
#include "cli/register_options.h"
#include "sixpoint/inspection/v1/assessment.grpc.pb.h"
#include "sixpoint/inspection/v1/deviation.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "sixpoint/inspection/v1/section.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::AssessmentService;
using inspection::v1::MeasurementOrder;

struct AssessArguments {
  std::string blade, drawing, clamping, sensor_calibration;
  std::vector<std::string> results, scans;
  bool before_machining = false, axis_tables = false;
};

inspection::v1::AssessmentStage StageOf(bool before_machining) {
  return before_machining ? inspection::v1::ASSESSMENT_STAGE_BEFORE_MACHINING
                          : inspection::v1::ASSESSMENT_STAGE_MACHINED;
}

// Orders what a plan asks for, one after another; the scans are registered once for each way of positioning.
class Measurer {
 public:
  Measurer(Session* session, const AssessArguments& arguments) : session_(session), arguments_(arguments) {}

  // The result's name.
  absl::StatusOr<std::string> Measure(const MeasurementOrder& order) {
    if (order.has_inspect()) return Inspect(order.inspect());
    const absl::StatusOr<std::string> registration = Register(order);
    if (!registration.ok()) return registration.status();
    if (order.has_map())
      return Made<inspection::v1::DeviationService>(&inspection::v1::DeviationService::Stub::MapDeviation, order.map(),
                                                    *registration, "comparing the surface with its CAD");
    return Made<inspection::v1::SectionService>(&inspection::v1::SectionService::Stub::MeasureSections,
                                                order.sections(), *registration, "cutting the blade");
  }

 private:
  template <typename Request>
  void AddScans(Request* request) const {
    request->set_blade(NameText("blades", arguments_.blade));
    for (const std::string& scan : arguments_.scans) request->add_scans(NameText("scans", scan));
    request->set_apply_axis_tables(arguments_.axis_tables);
    if (!arguments_.sensor_calibration.empty())
      request->set_sensor_calibration(NameText("calibrations", arguments_.sensor_calibration));
    request->set_request_id(NewRequestId());
  }

  absl::StatusOr<std::string> Inspect(inspection::v1::InspectRequest request) const {
    using inspection::v1::InspectionService;
    AddScans(&request);
    const auto made = CallAtLength<InspectionService>(session_, "inspecting the holes", "inspection",
                                                      &InspectionService::Stub::Inspect, request);
    if (!made.ok()) return made.status();
    return made->name();
  }

  absl::StatusOr<std::string> Register(const MeasurementOrder& order) {
    using registration::v1::RegistrationService;
    const std::string way = std::to_string(order.method()) + order.options().SerializeAsString();
    if (const auto known = registrations_.find(way); known != registrations_.end()) return known->second;
    registration::v1::RegisterRequest request;
    AddScans(&request);
    request.set_method(order.method());
    request.set_clamping(arguments_.clamping);
    if (order.options().ByteSizeLong() > 0) *request.mutable_options() = order.options();
    const auto made = CallAtLength<RegistrationService>(session_, "registering the blade", "registration",
                                                        &RegistrationService::Stub::Register, request);
    if (!made.ok()) return made.status();
    registrations_[way] = made->name();
    return made->name();
  }

  template <typename Service, typename Request, typename Response>
  absl::StatusOr<std::string> Made(grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                         Response*),
                                   Request request, const std::string& registration, const std::string& doing) const {
    request.set_registration(registration);
    request.set_request_id(NewRequestId());
    const auto made = CallAtLength<Service>(session_, doing, "inspection", method, request);
    if (!made.ok()) return made.status();
    return made->name();
  }

  Session* const session_;
  const AssessArguments& arguments_;
  std::map<std::string, std::string> registrations_;  // by method and options
};

absl::StatusOr<inspection::v1::AssessmentPlan> PlanOf(Session* session, const std::string& drawing,
                                                      bool before_machining) {
  inspection::v1::PlanAssessmentRequest request;
  request.set_drawing(NameText("drawings", drawing));
  request.set_stage(StageOf(before_machining));
  return CallAtLength<AssessmentService>(session, "", "inspection", &AssessmentService::Stub::PlanAssessment, request);
}

absl::Status Assess(Session* session, const AssessArguments& arguments) {
  inspection::v1::AssessBladeRequest request;
  request.set_blade(NameText("blades", arguments.blade));
  request.set_drawing(NameText("drawings", arguments.drawing));
  request.set_stage(StageOf(arguments.before_machining));
  request.set_request_id(NewRequestId());
  for (const std::string& result : arguments.results) request.add_results(result);
  if (!arguments.scans.empty()) {
    const auto plan = PlanOf(session, arguments.drawing, arguments.before_machining);
    if (!plan.ok()) return plan.status();
    request.set_drawing(plan->drawing());  // the revision that was measured for
    Measurer measurer(session, arguments);
    for (const MeasurementOrder& order : plan->orders()) {
      const absl::StatusOr<std::string> result = measurer.Measure(order);
      if (!result.ok()) return result.status();
      request.add_results(*result);
    }
  }
  return CallAndPrint<AssessmentService>(session, "inspection", &AssessmentService::Stub::AssessBlade, request,
                                         AssessmentText)
      .status();
}

}  // namespace

void AddAssessCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<AssessArguments>();
  Command* command =
      app->AddCommand("assess", "Judges a blade by its drawing; done means judged, whatever the verdict");
  command->AddOption("--blade", &arguments->blade, "Serial number")->Required();
  command->AddOption("--drawing", &arguments->drawing, "The drawing, or one of its revisions: ID@REVISION")->Required();
  Option* scans =
      command
          ->AddOption(
              "--scans", &arguments->scans,
              "Measures from them all that the drawing asks for: ID,ID,...; with pins in its holes where it asks for "
              "holes")
          ->List();
  command
      ->AddOption("--results", &arguments->results,
                  "Judges these, before what is measured: inspections/ID,deviations/ID,sections/ID,measurements/ID,...")
      ->List();
  command->AddFlag("--before-machining", &arguments->before_machining,
                   "A blank or casting: holes are not due; says whether a correction can cure what is out");
  const MappingOptions mapping = AddMappingOptions(command, &arguments->axis_tables, &arguments->sensor_calibration);
  for (Option* const only :
       {mapping.axis_tables, mapping.sensor_calibration,
        command->AddOption("--clamping", &arguments->clamping, "As the machine calls the clamping of the scans")})
    only->Needs(scans);
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    if (arguments->scans.empty() && arguments->results.empty())
      return runtime::Refuse("--scans", "nothing", "--scans ID,... or --results NAME,...");
    return Assess(session, *arguments);
  });
}

void AddAssessmentCommands(Command* app, Session* session) {
  Command* assessment =
      app->AddCommand("assessment", "Blades judged by their drawings, characteristic by characteristic");
  assessment->RequireCommand();
  struct Planned {
    std::string drawing;
    bool before_machining = false;
  };
  const auto planned = std::make_shared<Planned>();
  Command* plan = assessment->AddCommand("plan", "Shows what has to be measured so that a drawing can be judged");
  plan->AddOption("DRAWING", &planned->drawing, "The drawing, or one of its revisions: ID@REVISION")->Required();
  plan->AddFlag("--before-machining", &planned->before_machining, "Of a blank or casting");
  session->OnCommand(plan, [session, planned]() -> absl::Status {
    const auto found = PlanOf(session, planned->drawing, planned->before_machining);
    if (!found.ok()) return found.status();
    PrintMessage(session->json, *found, [&] { return AssessmentPlanText(*found); });
    return absl::OkStatus();
  });
  AddListCommand<AssessmentService>(
      assessment, session, "Lists assessments, newest first", "inspection", &AssessmentService::Stub::ListAssessments,
      inspection::v1::ListAssessmentsRequest(),
      Table({"assessment", "blade", "drawing", "stage", "verdict", "fate", ">conform", ">of", "by", "recorded"}),
      &inspection::v1::ListAssessmentsResponse::assessments, AssessmentCells);
  const auto id = std::make_shared<std::string>();
  Command* show = assessment->AddCommand("show", "Shows an assessment characteristic by characteristic");
  show->AddOption("ID", id.get(), "The assessment")->Required();
  session->OnCommand(show, [session, id] {
    inspection::v1::GetAssessmentRequest request;
    request.set_name(NameText("assessments", *id));
    return CallAndPrint<AssessmentService>(session, "inspection", &AssessmentService::Stub::GetAssessment, request,
                                           AssessmentText)
        .status();
  });
}

}  // namespace sixpoint::cli
