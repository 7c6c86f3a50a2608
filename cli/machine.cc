#include <iostream>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/plant_documents.h"
#include "cli/table.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::PlantService;

void AddJointRows(const std::string& side, const google::protobuf::RepeatedPtrField<plant::v1::Joint>& joints,
                  Table* table) {
  for (const plant::v1::Joint& joint : joints) {
    const bool rotary = joint.kind() == plant::v1::JOINT_KIND_ROTARY;
    const auto& d = joint.direction();
    table->AddRow({side, joint.axis(), rotary ? "rotary" : "linear",
                   Fixed(d.x(), 4) + ", " + Fixed(d.y(), 4) + ", " + Fixed(d.z(), 4),
                   rotary ? PointText(joint.point_mm(), 4) : "", Fixed(joint.minimum(), 1), Fixed(joint.maximum(), 1),
                   rotary ? "deg" : "mm",
                   joint.has_positioning_standard_uncertainty_deg()
                       ? Fixed(joint.positioning_standard_uncertainty_deg(), 6)
                       : ""});
  }
}

// What is not stated is in no uncertainty: it is said, too.
std::string ErrorSourcesText(const plant::v1::ErrorSources& sources) {
  std::string stated, open;
  const auto figure = [&](const char* what, bool given, double value, const char* unit) {
    std::string& text = given ? stated : open;
    text += (text.empty() ? "" : ", ") + std::string(what) + (given ? " " + Fixed(value, 2) + " " + unit : "");
  };
  figure("touch probe's offset", sources.has_touch_offset_um(), sources.touch_offset_um(), "um");
  figure("touch probe to tool", sources.has_tool_offset_um(), sources.tool_offset_um(), "um");
  figure("scanner's field", sources.has_scanner_field_um(), sources.scanner_field_um(), "um");
  figure("encoder's latency", sources.has_encoder_latency_um(), sources.encoder_latency_um(), "um");
  figure("linear axes' scales", sources.has_linear_scale_um_per_m(), sources.linear_scale_um_per_m(), "um/m");
  figure("their squareness", sources.has_squareness_um_per_m(), sources.squareness_um_per_m(), "um/m");
  figure("temperatures", sources.has_temperature_k(), sources.temperature_k(), "K");
  figure("without them 20 C within", sources.has_temperature_half_range_k(), sources.temperature_half_range_k(), "K");
  figure("scales' expansion", sources.has_scale_expansion(), sources.scale_expansion().um_per_m_k(), "um/m/K");
  const std::string approach = sources.approach() == plant::v1::APPROACH_UPWARDS     ? "from below"
                               : sources.approach() == plant::v1::APPROACH_DOWNWARDS ? "from above"
                                                                                     : "either way";
  return (stated.empty() ? "" : stated + "; ") + "angles are come to " + approach +
         (open.empty() ? "" : "; not stated: " + open);
}

std::string TouchProbeText(const plant::v1::TouchProbe& probe) {
  std::string text = probe.serial_number();
  if (probe.has_certificate())
    text += ", certificate " + probe.certificate().number() + " until " + TimeText(probe.certificate().expires_at());
  return text;
}

void PrintMachine(const Session& session, const plant::v1::Machine& machine) {
  if (session.json) return PrintJson(machine);
  const std::string& serial = machine.sensor().serial_number();
  std::cout << machine.name() << ", revision " << machine.revision() << ", " << TimeText(machine.created_at()) << "\n"
            << "sensor    " << machine.sensor().model() << (serial.empty() ? "" : " no. " + serial) << ", noise "
            << Fixed(machine.sensor().noise_um(), 2) << " um, range " << Fixed(machine.sensor().range_mm(), 1)
            << " mm about " << Fixed(machine.sensor().mid_range_mm(), 1) << " mm, "
            << (machine.sensor().kind() == plant::v1::SENSOR_KIND_SNAPSHOT
                    ? "snapshots"
                    : std::to_string(machine.sensor().column_count()) + " columns")
            << "\n"
            << "centre    " << PointText(machine.nominal_centre_mm(), 4) << " mm\n"
            << "released  within " << Fixed(machine.safety_envelope().translation_mm(), 2) << " mm and "
            << Fixed(machine.safety_envelope().rotation_deg(), 2) << " deg of nominal, U95 at most "
            << Fixed(100 * machine.safety_envelope().uncertainty_share(), 1) << " % of a tolerance, registered at most "
            << Fixed(machine.safety_envelope().registration_age_h(), 1) << " h ago, tool "
            << Fixed(machine.safety_envelope().keep_out_mm(), 2) << " mm from the part"
            << (machine.safety_envelope().has_interim_check_limit_um()
                    ? ", scanner checked within " + Fixed(machine.safety_envelope().interim_check_limit_um(), 1) +
                          " um in each clamping"
                    : "")
            << "\n"
            << "errors    " << ErrorSourcesText(machine.error_sources()) << "\n";
  if (machine.has_touch_probe()) std::cout << "touched   by " << TouchProbeText(machine.touch_probe()) << "\n";
  Table table({"side", "axis", "kind", "direction", "point mm", ">from", ">to", "unit", ">reaches within deg"});
  AddJointRows("part", machine.kinematics().part_side(), &table);
  AddJointRows("tool", machine.kinematics().tool_side(), &table);
  if (!table.empty()) std::cout << table.ToText();
}

}  // namespace

void AddMachineCommands(Command* app, Session* session) {
  Command* machine = app->AddCommand("machine", "Machines: kinematics, sensor, limits");
  machine->RequireCommand();
  const auto argument = std::make_shared<std::string>();

  Command* add = machine->AddCommand("add", "Adds a machine, or a new revision of it, from a YAML file");
  add->AddOption("FILE", argument.get(), "YAML as docs/examples/machine.yaml")->Required();
  session->OnCommand(add, [session, argument]() -> absl::Status {
    absl::StatusOr<plant::v1::CreateMachineRequest> request = LoadMachine(*argument);
    if (!request.ok()) return request.status();
    request->set_request_id(NewRequestId());
    plant::v1::Machine response;
    absl::Status status = session->Call<PlantService>("plant", &PlantService::Stub::CreateMachine, *request, &response);
    if (status.ok()) PrintMachine(*session, response);
    return status;
  });

  AddListCommand<PlantService>(machine, session, "Lists the machines", "plant", &PlantService::Stub::ListMachines,
                               plant::v1::ListMachinesRequest(), Table({"machine", ">revision", "sensor", "since"}),
                               &plant::v1::ListMachinesResponse::machines, [](const plant::v1::Machine& entry) {
                                 return Cells{IdText(entry.name()), std::to_string(entry.revision()),
                                              entry.sensor().model(), TimeText(entry.created_at())};
                               });

  Command* show = machine->AddCommand("show", "Shows a machine");
  show->AddOption("ID", argument.get(), "The machine")->Required();
  session->OnCommand(show, [session, argument]() -> absl::Status {
    plant::v1::GetMachineRequest request;
    request.set_name(NameText("machines", *argument));
    plant::v1::Machine response;
    absl::Status status = session->Call<PlantService>("plant", &PlantService::Stub::GetMachine, request, &response);
    if (status.ok()) PrintMachine(*session, response);
    return status;
  });
}

}  // namespace sixpoint::cli
