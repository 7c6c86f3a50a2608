#include "cli/commands.h"
#include "cli/register_options.h"
#include "cli/reports.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"

namespace sixpoint::cli {

using inspection::v1::InspectionService;

void AddInspectCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<ScansToRegister>();
  Command* command = app->AddCommand("inspect", "Judges a machined blade; done means judged, whatever the verdict");
  const ScansToRegisterOptions options = AddScansToRegister(command, arguments.get(), RegisteredFor::kInspection);
  options.blade->Required();
  options.scans->Required();
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    auto positioned = RegisterRequestOf(*arguments);
    if (!positioned.ok()) return positioned.status();
    inspection::v1::InspectRequest request;
    request.set_blade(positioned->blade());
    *request.mutable_scans() = std::move(*positioned->mutable_scans());
    request.set_method(positioned->method());
    if (positioned->options().ByteSizeLong() > 0) *request.mutable_options() = positioned->options();
    request.set_apply_axis_tables(positioned->apply_axis_tables());
    request.set_sensor_calibration(positioned->sensor_calibration());
    request.set_request_id(NewRequestId());
    return CallAndPrint<InspectionService>(session, "inspection", &InspectionService::Stub::Inspect, request,
                                           InspectionText, "inspecting " + arguments->blade)
        .status();
  });
}

}  // namespace sixpoint::cli
