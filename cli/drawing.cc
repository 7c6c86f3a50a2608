#include <iostream>

#include "cli/commands.h"
#include "cli/drawing_document.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "cli/table.h"
#include "refusal/message_text.h"
#include "sixpoint/plant/v1/drawing.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::Characteristic;
using plant::v1::DrawingService;

struct DrawingArguments {
  std::string file_or_id;
  int revises = -1;  // not said
};

std::string QuantityText(const Characteristic& one) {
  std::string text = EnumText(CharacteristicQuantity_Name(one.quantity()), "CHARACTERISTIC_QUANTITY_");
  if (one.algorithm() != 0)
    text += ", " + EnumText(CharacteristicAlgorithm_Name(one.algorithm()), "CHARACTERISTIC_ALGORITHM_");
  return text;
}

std::string PlaceText(const Characteristic& one) {
  std::string text = one.hole_group();
  if (!one.hole().empty()) text += "/" + one.hole();
  if (!one.to_hole().empty()) text += " to " + one.to_hole();
  for (const std::string* const more : {&one.section(), &one.region()})
    if (!more->empty()) text += (text.empty() ? "" : ", ") + *more;
  if (!one.reference_section().empty()) text += " from " + one.reference_section();
  const bool whole = one.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM ||
                     one.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION;
  return text.empty() ? (whole ? "all of it" : "-") : text;
}

std::string OrDash(const std::string& text) { return text.empty() ? "-" : text; }

Cells CharacteristicRowOf(const Characteristic& one) {
  return {one.characteristic(),
          one.name(),
          EnumText(CharacteristicClass_Name(one.characteristic_class()), "CHARACTERISTIC_CLASS_"),
          OrDash(one.designator()),
          QuantityText(one),
          PlaceText(one),
          one.has_nominal() ? NumberText(one.nominal()) : "-",
          one.has_lower_limit() ? NumberText(one.lower_limit()) : "-",
          one.has_upper_limit() ? NumberText(one.upper_limit()) : "-",
          EnumText(CharacteristicUnit_Name(one.unit()), "CHARACTERISTIC_UNIT_"),
          one.zone() == 0 ? "-" : EnumText(ToleranceZone_Name(one.zone()), "TOLERANCE_ZONE_"),
          OrDash(one.datum_system()),
          one.has_decision_rule() ? RuleText(one.decision_rule()) : "-",
          one.reference_location(),
          one.requirement()};
}

void PrintPlaces(const plant::v1::Drawing& drawing) {
  for (const plant::v1::DatumSystem& system : drawing.datum_systems()) {
    std::cout << "datums   " << system.datum_system() << " by "
              << EnumText(DatumPositioning_Name(system.positioning()), "DATUM_POSITIONING_");
    if (!system.region().empty()) std::cout << " of " << system.region();
    for (const plant::v1::Datum& datum : system.datums()) {
      if (datum.datum_points().empty()) continue;
      std::cout << ", " << datum.datum() << ":";
      for (const std::string& point : datum.datum_points()) std::cout << " " << point;
    }
    std::cout << "\n";
  }
  for (const plant::v1::DrawingSection& section : drawing.sections())
    std::cout << "section  " << section.section() << ", "
              << (section.has_height_mm() ? "at " + NumberText(section.height_mm()) + " mm"
                                          : "through " + PointText(section.origin_in_part_mm(), 3) + " mm")
              << ", points within " << NumberText(section.half_width_mm()) << " mm\n";
  for (const plant::v1::DrawingRegion& region : drawing.regions()) std::cout << "region   " << region.region() << "\n";
  if (drawing.has_neighbour())
    std::cout << "next     " << PointText(drawing.neighbour().offset_in_part_mm(), 3) << " mm away\n";
  for (const plant::v1::ProductRequirement& one : drawing.product_requirements())
    std::cout << EnumText(ProductRequirementKind_Name(one.kind()), "PRODUCT_REQUIREMENT_KIND_") << ": "
              << one.requirement() << ", " << one.specification() << (one.code().empty() ? "" : ", " + one.code())
              << (one.customer_approval() ? ", by whom the customer approves" : "") << "\n";
}

void PrintDrawing(const Session& session, const plant::v1::Drawing& drawing) {
  if (session.json) return PrintJson(drawing);
  std::cout << drawing.name() << ", revision " << drawing.revision() << ", " << TimeText(drawing.created_at())
            << ", by " << drawing.requested_by() << "\n"
            << "drawing  " << drawing.drawing_number() << ", revision " << drawing.drawing_revision();
  for (const std::string& change : drawing.additional_changes()) std::cout << ", with " << change;
  std::cout << "\npart     " << drawing.part_number() << ", " << drawing.part_name();
  if (!drawing.part_revision_level().empty()) std::cout << ", revision " << drawing.part_revision_level();
  std::cout << "\nvalid    for " << drawing.part();
  for (int i = 0; i < drawing.part_revisions_size(); ++i)
    std::cout << (i == 0 ? "@" : ", @") << drawing.part_revisions(i);
  std::cout << "\njudged   by " << RuleText(drawing.decision_rule()) << "\n";
  PrintPlaces(drawing);
  Table table({"no.", "name", "class", "mark", "quantity", "of", ">nominal", ">lower", ">upper", "unit", "zone",
               "datums", "rule", "on", "requirement"});
  for (const Characteristic& one : drawing.characteristics()) table.AddRow(CharacteristicRowOf(one));
  std::cout << table.ToText();
}

absl::Status AddDrawing(Session* session, const DrawingArguments& arguments) {
  absl::StatusOr<plant::v1::CreateDrawingRequest> request = LoadDrawing(arguments.file_or_id);
  if (!request.ok()) return request.status();
  request->set_request_id(NewRequestId());
  if (arguments.revises >= 0) request->set_revises(arguments.revises);
  plant::v1::Drawing response;
  absl::Status status =
      session->Call<DrawingService>("plant", &DrawingService::Stub::CreateDrawing, *request, &response);
  if (status.ok()) PrintDrawing(*session, response);
  return status;
}

absl::Status ShowDrawing(Session* session, const DrawingArguments& arguments) {
  plant::v1::GetDrawingRequest request;
  request.set_name(NameText("drawings", arguments.file_or_id));
  plant::v1::Drawing response;
  absl::Status status = session->Call<DrawingService>("plant", &DrawingService::Stub::GetDrawing, request, &response);
  if (status.ok()) PrintDrawing(*session, response);
  return status;
}

}  // namespace

void AddDrawingCommands(Command* app, Session* session) {
  Command* drawing = app->AddCommand("drawing", "Drawings: characteristics by their balloons, datums, sections, rules");
  drawing->RequireCommand();
  const auto arguments = std::make_shared<DrawingArguments>();

  Command* add = drawing->AddCommand("add", "Adds a drawing, or a new revision of it, from a YAML file");
  add->AddOption("FILE", &arguments->file_or_id, "YAML as docs/examples/drawing.yaml")->Required();
  add->AddOption("--revises", &arguments->revises,
                 "Refused unless this is the newest revision, whose place it takes; 0: there is none yet")
      ->Within(0, 999'999'999);
  session->OnCommand(add, [session, arguments] { return AddDrawing(session, *arguments); });

  AddListCommand<DrawingService>(
      drawing, session, "Lists the drawings", "plant", &DrawingService::Stub::ListDrawings,
      plant::v1::ListDrawingsRequest(),
      Table({"drawing", ">revision", "number", "rev", "part", "name", ">characteristics", "since"}),
      &plant::v1::ListDrawingsResponse::drawings, [](const plant::v1::Drawing& entry) {
        return Cells{IdText(entry.name()),
                     std::to_string(entry.revision()),
                     entry.drawing_number(),
                     entry.drawing_revision(),
                     IdText(entry.part()),
                     entry.part_name(),
                     std::to_string(entry.characteristic_count()),
                     TimeText(entry.created_at())};
      });

  Command* show = drawing->AddCommand("show", "Shows a drawing, characteristic by characteristic");
  show->AddOption("ID", &arguments->file_or_id, "The drawing, or one of its revisions: ID@REVISION")->Required();
  session->OnCommand(show, [session, arguments] { return ShowDrawing(session, *arguments); });
}

}  // namespace sixpoint::cli
