// `sixpoint section`: airfoil sections of blades.
#include <cmath>

#include "cli/commands.h"
#include "cli/download_command.h"
#include "cli/number_format.h"
#include "cli/out_file.h"
#include "cli/reports.h"
#include "cli/section_document.h"
#include "sixpoint/inspection/v1/section.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::Section;
using inspection::v1::SectionMeasurement;
using inspection::v1::SectionService;
using inspection::v1::SectionValue;

std::string ParameterText(const SectionValue& value) {
  return EnumText(inspection::v1::SectionParameter_Name(value.parameter()), "SECTION_PARAMETER_");
}

// Enough places that U has two digits where it is a micrometre or a thousandth of a degree.
std::string NumberIn(inspection::v1::SectionUnit unit, double value) {
  return Fixed(value, unit == inspection::v1::SECTION_UNIT_MM ? 4 : 5);
}

std::string UnitText(inspection::v1::SectionUnit unit) {
  return unit == inspection::v1::SECTION_UNIT_MM ? "mm" : unit == inspection::v1::SECTION_UNIT_DEG ? "deg" : "-";
}

std::string EndText(inspection::v1::SectionEnd end) {
  return EnumText(inspection::v1::SectionEnd_Name(end), "SECTION_END_");
}

std::string SectionText(const Section& section) {
  std::string head =
      "\nsection " + section.plane().section() + " at " + PointText(section.plane().origin_in_part_mm(), 3) + ": ";
  if (!section.reason().empty()) return head + "not measured: " + section.reason() + "\n";
  head += Grouped(section.point_count()) + " points, noise " + Fixed(section.noise_um(), 2) + " um, wavers by " +
          Fixed(section.waver_um(), 2) + " um over " + Fixed(section.waver_length_mm(), 1) + " mm; leading end " +
          EndText(section.leading()) + ", trailing end " + EndText(section.trailing());
  if (section.gap_share() > 0) head += "; " + Fixed(100 * section.gap_share(), 1) + " % of the outline not seen";
  Table table({"parameter", "unit", ">nominal", ">measured", ">deviation", ">U", "not measured because"});
  for (const SectionValue& value : section.values()) {
    const auto number = [&](bool known, double of) { return known ? NumberIn(value.unit(), of) : std::string(); };
    table.AddRow({ParameterText(value), UnitText(value.unit()), number(value.has_nominal(), value.nominal()),
                  number(value.has_value(), value.value()),
                  number(value.has_value() && value.has_nominal(), value.value() - value.nominal()),
                  number(value.has_expanded_uncertainty(), value.expanded_uncertainty()), value.reason()});
  }
  return head + "\n" + table.ToText();
}

std::string MeasurementText(const SectionMeasurement& measurement) {
  std::string text = measurement.name() + " of " + measurement.blade() + " by " + measurement.registration() + " (" +
                     MethodText(measurement.method()) + "); twist from " + measurement.reference_section() + "\n";
  for (const Section& section : measurement.sections()) text += SectionText(section);
  return text;
}

void AddHeights(const std::vector<double>& heights_mm, inspection::v1::MeasureSectionsRequest* request) {
  for (const double height_mm : heights_mm) {
    inspection::v1::SectionPlane& plane = *request->add_sections();
    plane.set_section("z " + Significant(height_mm));
    plane.mutable_origin_in_part_mm()->set_z_mm(height_mm);
  }
}

void AddMeasureCommand(Command* section, Session* session) {
  struct Arguments {
    std::string registration, planes, reference;
    std::vector<double> heights_mm;
    std::optional<double> half_width_mm;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* measure =
      section->AddCommand("measure", "Measures a registered blade's sections; done means measured and recorded");
  measure->AddOption("REGISTRATION", &arguments->registration, "The registration that says how the blade stands")
      ->Required();
  measure->AddOption("--heights", &arguments->heights_mm, "Z,Z,...: across the part's Z at these heights, mm")->List();
  measure->AddOption("--planes", &arguments->planes,
                     "YAML or JSON file of planes, and of the neighbour for the throat");
  measure->AddOption("--half-width-mm", &arguments->half_width_mm,
                     "Points so far from a plane are taken; without it 0.1");
  measure->AddOption("--reference", &arguments->reference, "Section that twist is told from; without it the first");
  session->OnCommand(measure, [session, arguments]() -> absl::Status {
    inspection::v1::MeasureSectionsRequest request;
    request.set_registration(NameText("registrations", arguments->registration));
    request.set_request_id(NewRequestId());
    if (arguments->half_width_mm) request.set_half_width_mm(*arguments->half_width_mm);
    request.set_reference_section(arguments->reference);
    if (!arguments->planes.empty())
      if (absl::Status read = ReadSectionDocument(arguments->planes, &request); !read.ok()) return read;
    AddHeights(arguments->heights_mm, &request);
    if (request.sections().empty()) return runtime::Refuse("--heights", "nothing", "--heights Z,... or --planes FILE");
    return CallAndPrint<SectionService>(session, "inspection", &SectionService::Stub::MeasureSections, request,
                                        MeasurementText, "cutting the blade")
        .status();
  });
}

std::string CsvOf(const inspection::v1::SectionOutline& outline) {
  std::string csv;
  const auto add = [&](const char* which, int place, double x_mm, double y_mm, const std::string& rest) {
    csv += CsvCell(outline.section()) + "," + which + "," + std::to_string(place) + "," + Fixed(x_mm, 6) + "," +
           Fixed(y_mm, 6) + "," + rest + "\n";
  };
  for (int i = 0; 2 * i + 1 < outline.nominal_mm_size(); ++i)
    add("nominal", i, outline.nominal_mm(2 * i), outline.nominal_mm(2 * i + 1), ",");
  int gap = 0;
  for (int i = 0; i < outline.deviations_um_size(); ++i) {
    const bool after_gap = gap < outline.gaps_before_size() && outline.gaps_before(gap) == i;
    if (after_gap) ++gap;
    add("measured", i, outline.measured_mm(2 * i), outline.measured_mm(2 * i + 1),
        Fixed(outline.deviations_um(i), 3) + "," + (after_gap ? "gap" : ""));
  }
  return csv;
}

absl::StatusOr<std::string> FetchOutlines(Session* session, const std::string& name, const std::string&) {
  inspection::v1::DownloadSectionOutlinesRequest request;
  request.set_name(name);
  return FetchContent<SectionService>(session, "downloading " + name, "inspection",
                                      &SectionService::Stub::DownloadSectionOutlines, request,
                                      "section,outline,place,x_mm,y_mm,deviation_um,before\n",
                                      [](const inspection::v1::SectionOutline& one) { return CsvOf(one); });
}

}  // namespace

void AddSectionCommands(Command* app, Session* session) {
  Command* section = app->AddCommand("section", "Airfoil sections of blades: chord, stagger, thickness, edges, twist");
  section->RequireCommand();
  AddMeasureCommand(section, session);
  AddListCommand<SectionService>(
      section, session, "Lists section measurements, newest first", "inspection",
      &SectionService::Stub::ListSectionMeasurements, inspection::v1::ListSectionMeasurementsRequest(),
      Table({"measurement", "blade", "positioned by", ">sections", ">measured", "by", "recorded"}),
      &inspection::v1::ListSectionMeasurementsResponse::sections, [](const SectionMeasurement& measurement) {
        int measured = 0;
        for (const Section& one : measurement.sections()) measured += one.reason().empty() ? 1 : 0;
        return Cells{IdText(measurement.name()),         IdText(measurement.blade()),
                     MethodText(measurement.method()),   std::to_string(measurement.sections_size()),
                     std::to_string(measured),           measurement.requested_by(),
                     TimeText(measurement.recorded_at())};
      });
  const auto id = std::make_shared<std::string>();
  Command* show = section->AddCommand("show", "Shows a measurement section by section");
  show->AddOption("ID", id.get(), "The section measurement")->Required();
  session->OnCommand(show, [session, id] {
    inspection::v1::GetSectionMeasurementRequest request;
    request.set_name(NameText("sections", *id));
    return CallAndPrint<SectionService>(session, "inspection", &SectionService::Stub::GetSectionMeasurement, request,
                                        MeasurementText)
        .status();
  });
  AddDownloadCommand(section, session,
                     {"outlines", "Writes a measurement's outlines, the CAD's and the measured", "CSV file"},
                     "The section measurement", "sections", FetchOutlines);
}

}  // namespace sixpoint::cli
