// `sixpoint measurement`: what other instruments measured of blades, from their files.
#include <map>

#include "cli/commands.h"
#include "cli/document.h"
#include "cli/number_format.h"
#include "refusal/message_text.h"
#include "sixpoint/inspection/v1/measurement.grpc.pb.h"
#include "sixpoint/plant/v1/drawing.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::CompareMeasurementsResponse;
using inspection::v1::ImportMeasurementsRequest;
using inspection::v1::ImportMeasurementsResponse;
using inspection::v1::MeasuredCharacteristic;
using inspection::v1::Measurement;
using inspection::v1::MeasurementService;
using plant::v1::ToleranceZone;

constexpr std::uint64_t kGreatestFileBytes = 4u << 20;

std::string InstrumentText(const inspection::v1::Instrument& instrument) {
  return EnumText(inspection::v1::InstrumentKind_Name(instrument.kind()), "INSTRUMENT_KIND_") + " " +
         instrument.manufacturer() + " " + instrument.model() + ", " + instrument.serial_number();
}

std::string UnitText(plant::v1::CharacteristicUnit unit) {
  return EnumText(plant::v1::CharacteristicUnit_Name(unit), "CHARACTERISTIC_UNIT_");
}

std::string ZoneText(ToleranceZone zone) {
  return zone == plant::v1::TOLERANCE_ZONE_UNSPECIFIED
             ? ""
             : EnumText(plant::v1::ToleranceZone_Name(zone), "TOLERANCE_ZONE_");
}

std::string StatedText(const inspection::v1::StatedUncertainty& stated) {
  std::string text;
  if (stated.has_lengths_um()) text += " lengths " + NumberText(stated.lengths_um()) + " um";
  if (stated.has_angles_deg())
    text += std::string(text.empty() ? "" : ",") + " angles " + NumberText(stated.angles_deg()) + " deg";
  return "stated  U of" + text + " (95 %), by " + stated.basis() + "\n";
}

// names: of the drawing's characteristics, by their balloons.
std::string MeasurementText(const Measurement& measurement, const std::map<std::string, std::string>& names) {
  std::string text = measurement.name() + " of " + measurement.blade() + " by " + measurement.drawing() + "\n" +
                     "with    " + InstrumentText(measurement.instrument());
  if (!measurement.instrument().certificate().empty())
    text += ", certificate " + measurement.instrument().certificate();
  text += "\nat      " + TimeText(measurement.measured_at()) + ", imported " + TimeText(measurement.recorded_at()) +
          " by " + measurement.requested_by() + "\nfile    " +
          EnumText(inspection::v1::MeasurementFormat_Name(measurement.format()), "MEASUREMENT_FORMAT_") + ", SHA-256 " +
          measurement.file_sha256() + "\n";
  if (measurement.has_uncertainty()) text += StatedText(measurement.uncertainty());
  Table table({"no.", "name", "of", "unit", "is the", ">measured", ">U", "not measured because"});
  for (const MeasuredCharacteristic& value : measurement.values()) {
    const auto name = names.find(value.characteristic());
    table.AddRow({value.characteristic(), name == names.end() ? "" : name->second, value.feature(),
                  UnitText(value.unit()), ZoneText(value.zone()), value.has_value() ? NumberText(value.value()) : "",
                  value.has_expanded_uncertainty() ? NumberText(value.expanded_uncertainty()) : "", value.reason()});
  }
  text += table.ToText();
  if (measurement.left_out_count() > 0) {
    text += "left out, for the drawing does not have them: " + Grouped(measurement.left_out_count()) + ", such as ";
    for (int i = 0; i < measurement.left_out_size() && i < 10; ++i)
      text += (i == 0 ? "" : ", ") + measurement.left_out(i);
    text += "\n";
  }
  return text;
}

struct MeasurementArguments {
  std::string file, drawing, format, kind, manufacturer, model, serial_number, certificate;
  std::string blade, measured_at, basis, position_zone, profile_zone;
  std::optional<double> lengths_um, angles_deg;
  bool only_drawn = false;
};

// By the ending of its name, where it was not said.
absl::StatusOr<inspection::v1::MeasurementFormat> FormatOf(const MeasurementArguments& arguments) {
  std::string word = arguments.format;
  if (word.empty()) {
    std::string ending = arguments.file.substr(arguments.file.rfind('.') + 1);
    for (char& c : ending)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    word = ending == "dfq" || ending == "dfx" ? "aqdef" : ending;
  }
  if (word == "qif") return inspection::v1::MEASUREMENT_FORMAT_QIF;
  if (word == "aqdef") return inspection::v1::MEASUREMENT_FORMAT_AQDEF;
  if (word == "csv") return inspection::v1::MEASUREMENT_FORMAT_CSV;
  return runtime::Refuse("FILE", arguments.file, "a name that ends in .qif, .dfq or .csv, or --format");
}

ToleranceZone ZoneOf(const std::string& word) {
  return word.empty() ? plant::v1::TOLERANCE_ZONE_UNSPECIFIED
                      : static_cast<ToleranceZone>(ValueOf(*plant::v1::ToleranceZone_descriptor(), word));
}

absl::StatusOr<ImportMeasurementsRequest> RequestOf(const MeasurementArguments& arguments) {
  ImportMeasurementsRequest request;
  const auto format = FormatOf(arguments);
  if (!format.ok()) return format.status();
  auto content = ReadFile(arguments.file, kGreatestFileBytes);
  if (!content.ok()) return content.status();
  request.set_content(*std::move(content));
  request.set_format(*format);
  request.set_drawing(NameText("drawings", arguments.drawing));
  request.set_request_id(NewRequestId());
  inspection::v1::Instrument& instrument = *request.mutable_instrument();
  instrument.set_kind(static_cast<inspection::v1::InstrumentKind>(
      ValueOf(*inspection::v1::InstrumentKind_descriptor(), arguments.kind)));
  instrument.set_manufacturer(arguments.manufacturer);
  instrument.set_model(arguments.model);
  instrument.set_serial_number(arguments.serial_number);
  instrument.set_certificate(arguments.certificate);
  if (!arguments.blade.empty()) request.set_blade(NameText("blades", arguments.blade));
  if (!arguments.measured_at.empty()) {
    const auto at = TimeOf("--measured-at", arguments.measured_at);
    if (!at.ok()) return at.status();
    *request.mutable_measured_at() = *at;
  }
  if (arguments.lengths_um) request.mutable_uncertainty()->set_lengths_um(*arguments.lengths_um);
  if (arguments.angles_deg) request.mutable_uncertainty()->set_angles_deg(*arguments.angles_deg);
  if (!arguments.basis.empty()) request.mutable_uncertainty()->set_basis(arguments.basis);
  request.set_position_zone(ZoneOf(arguments.position_zone));
  request.set_profile_zone(ZoneOf(arguments.profile_zone));
  request.set_only_drawn(arguments.only_drawn);
  return request;
}

std::string ImportText(const ImportMeasurementsResponse& response) {
  Table table({"measurement", "blade", "measured at", ">values", ">measured", ">left out"});
  for (const Measurement& measurement : response.measurements())
    table.AddRow({IdText(measurement.name()), IdText(measurement.blade()), TimeText(measurement.measured_at()),
                  std::to_string(measurement.value_count()), std::to_string(measurement.measured_count()),
                  std::to_string(measurement.left_out_count())});
  return table.ToText();
}

void AddImportCommand(Command* measurement, Session* session) {
  const auto arguments = std::make_shared<MeasurementArguments>();
  Command* import = measurement->AddCommand("import", "Imports a file of another instrument, all of it or nothing");
  import->AddOption("FILE", &arguments->file, "QIF 3.0 results, AQDEF (.dfq) or CSV; docs/exchange.md, import")
      ->Required();
  import->AddOption("--drawing", &arguments->drawing, "Whose characteristics they are: ID, or ID@REVISION")->Required();
  import->AddOption("--format", &arguments->format, "Without it by the file's name")->OneOf({"qif", "aqdef", "csv"});
  import->AddOption("--instrument-kind", &arguments->kind, "What it was measured with")
      ->Required()
      ->OneOf(WordsOf(*inspection::v1::InstrumentKind_descriptor()));
  import->AddOption("--instrument-manufacturer", &arguments->manufacturer, "Its maker")->Required();
  import->AddOption("--instrument-model", &arguments->model, "As its maker calls it")->Required();
  import->AddOption("--instrument-serial-number", &arguments->serial_number, "Which of them")->Required();
  import->AddOption("--instrument-certificate", &arguments->certificate, "Number of its calibration certificate");
  import->AddOption("--blade", &arguments->blade, "Serial number, where the file tells none");
  import->AddOption("--measured-at", &arguments->measured_at, "When, where the file does not tell");
  import->AddOption("--uncertainty-um", &arguments->lengths_um,
                    "Expanded uncertainty (95 %) of lengths of which the file states none");
  import->AddOption("--uncertainty-deg", &arguments->angles_deg, "The same of angles");
  import->AddOption("--uncertainty-basis", &arguments->basis, "How these were found: a report, a standard");
  import
      ->AddOption("--position-zone", &arguments->position_zone,
                  "What positions are the size of, where the file does not tell")
      ->OneOf({"diameter", "radius"});
  import->AddOption("--profile-zone", &arguments->profile_zone, "The same of profiles")
      ->OneOf({"width", "half-width", "borders"});
  import->AddFlag("--only-drawn", &arguments->only_drawn, "Leaves out what the drawing does not have");
  session->OnCommand(import, [session, arguments]() -> absl::Status {
    const auto request = RequestOf(*arguments);
    if (!request.ok()) return request.status();
    return CallAndPrint<MeasurementService>(session, "inspection", &MeasurementService::Stub::ImportMeasurements,
                                            *request, ImportText, "reading the file")
        .status();
  });
}

absl::Status ShowMeasurement(Session* session, const std::string& id) {
  inspection::v1::GetMeasurementRequest request;
  request.set_name(NameText("measurements", id));
  const auto measurement = CallAtLength<MeasurementService, inspection::v1::GetMeasurementRequest, Measurement>(
      session, "", "inspection", &MeasurementService::Stub::GetMeasurement, request);
  if (!measurement.ok()) return measurement.status();
  std::map<std::string, std::string> names;
  if (!session->json) {
    plant::v1::GetDrawingRequest of;
    of.set_name(measurement->drawing());
    plant::v1::Drawing drawing;
    const absl::Status found =
        session->Call<plant::v1::DrawingService>("plant", &plant::v1::DrawingService::Stub::GetDrawing, of, &drawing);
    if (!found.ok()) return found;
    for (const plant::v1::Characteristic& one : drawing.characteristics()) names[one.characteristic()] = one.name();
  }
  PrintMessage(session->json, *measurement, [&] { return MeasurementText(*measurement, names); });
  return absl::OkStatus();
}

std::string ComparedText(const CompareMeasurementsResponse& compared) {
  if (compared.biases().empty()) return "no blade has values of both by " + compared.drawing() + "\n";
  Table table({"no.", "name", "of", "unit", ">blades", ">ours - theirs", ">U", ">spread", "verdict"});
  for (const inspection::v1::InstrumentBias& bias : compared.biases())
    table.AddRow({bias.characteristic(), bias.name(), bias.feature(), UnitText(bias.unit()),
                  std::to_string(bias.pairs_size()), Significant(bias.bias()),
                  bias.has_expanded_uncertainty() ? Significant(bias.expanded_uncertainty()) : "",
                  bias.has_standard_deviation() ? Significant(bias.standard_deviation()) : "",
                  EnumText(inspection::v1::BiasVerdict_Name(bias.verdict()), "BIAS_VERDICT_") +
                      (bias.unstated_count() > 0 ? ", not all uncertainties are stated" : "")});
  return table.ToText() + Grouped(compared.measurement_count()) + " measurements by " + compared.drawing() +
         (compared.truncated() ? ", the newest; there are more" : "") + "\n";
}

void AddCompareCommand(Command* measurement, Session* session) {
  struct Asked {
    std::string drawing, serial_number, since, until;
  };
  const auto asked = std::make_shared<Asked>();
  Command* compare = measurement->AddCommand("compare", "Our values beside theirs: how far ours are off, with U");
  compare->AddOption("DRAWING", &asked->drawing, "By whose characteristics: ID, or ID@REVISION")->Required();
  compare->AddOption("--instrument-serial-number", &asked->serial_number, "Only those with this instrument");
  compare->AddOption("--since", &asked->since, "Only measurements that were recorded from then on");
  compare->AddOption("--until", &asked->until, "Only measurements that were recorded before then");
  session->OnCommand(compare, [session, asked]() -> absl::Status {
    inspection::v1::CompareMeasurementsRequest request;
    request.set_drawing(NameText("drawings", asked->drawing));
    request.set_instrument_serial_number(asked->serial_number);
    const auto recorded = TimeRangeOf(asked->since, asked->until);
    if (!recorded.ok()) return recorded.status();
    *request.mutable_recorded() = *recorded;
    return CallAndPrint<MeasurementService>(session, "inspection", &MeasurementService::Stub::CompareMeasurements,
                                            request, ComparedText)
        .status();
  });
}

}  // namespace

void AddMeasurementCommands(Command* app, Session* session) {
  Command* measurement =
      app->AddCommand("measurement", "Measurements of other instruments: CMM, optical, CT, gauges, from their files");
  measurement->RequireCommand();
  AddImportCommand(measurement, session);
  AddListCommand<MeasurementService>(
      measurement, session, "Lists measurements of other instruments, newest first", "inspection",
      &MeasurementService::Stub::ListMeasurements, inspection::v1::ListMeasurementsRequest(),
      Table({"measurement", "blade", "drawing", "instrument", "measured at", ">values", ">measured", "by", "recorded"}),
      &inspection::v1::ListMeasurementsResponse::measurements, [](const Measurement& one) {
        return Cells{IdText(one.name()),
                     IdText(one.blade()),
                     IdText(one.drawing()),
                     InstrumentText(one.instrument()),
                     TimeText(one.measured_at()),
                     std::to_string(one.value_count()),
                     std::to_string(one.measured_count()),
                     one.requested_by(),
                     TimeText(one.recorded_at())};
      });
  const auto id = std::make_shared<std::string>();
  Command* show = measurement->AddCommand("show", "Shows a measurement value by value");
  show->AddOption("ID", id.get(), "The measurement")->Required();
  session->OnCommand(show, [session, id] { return ShowMeasurement(session, *id); });
  AddCompareCommand(measurement, session);
}

}  // namespace sixpoint::cli
