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

// Nothing where the surface is a whole skin whose edges lie on its faces.
std::string GapsText(const plant::v1::SurfaceSummary& surface) {
  std::string text;
  if (surface.open_rim_count() > 0)
    text += "open     " + Grouped(surface.open_rim_count()) + " rims, " + Fixed(surface.open_rim_length_mm(), 3) +
            " mm together: the surface ends there\n";
  if (surface.degenerate_triangle_count() > 0)
    text += "left out " + Grouped(surface.degenerate_triangle_count()) + " triangles without area\n";
  if (surface.gap_um() > 0)
    text += "gap      " + Fixed(surface.gap_um(), 1) + " um between faces at most, at " +
            PointText(surface.gap_at_mm(), 3) + " mm: marked, a source of what rests on the surface there\n";
  if (surface.healed_um() > 0)
    text += "healed   edges lay " + Fixed(surface.healed_um(), 1) + " um off their faces at most\n";
  return text;
}

void PrintPart(const Session& session, const plant::v1::Part& part) {
  if (session.json) return PrintJson(part);
  std::cout << part.name() << ", revision " << part.revision() << ", " << TimeText(part.created_at()) << "\n"
            << (part.customer().empty() ? "" : "customer " + part.customer() + "\n") << "cad      "
            << EnumText(CadFormat_Name(part.cad_format()), "CAD_FORMAT_") << ", sha256 " << part.surface().cad_sha256()
            << "\n"
            << (part.solid().empty() ? "" : "solid    " + part.solid() + "\n") << "surface  "
            << Grouped(part.surface().triangle_count()) << " triangles within "
            << Fixed(part.surface().chordal_error_um(), 3) << " um, " << (part.surface().closed() ? "closed" : "open")
            << ", from " << PointText(part.surface().minimum_mm(), 3) << " to "
            << PointText(part.surface().maximum_mm(), 3) << " mm\n"
            << GapsText(part.surface());
  Table groups({"group", ">holes", ">diameter mm", ">depth mm", ">A deg", ">B deg", ">position tol mm", "zone",
                ">inclination tol deg", ">gauge pin mm"});
  for (const auto& group : part.hole_groups()) {
    groups.AddRow({group.group(), std::to_string(group.holes_size()), Fixed(group.diameter_mm(), 3),
                   Fixed(group.depth_mm(), 2), Fixed(group.a_nominal_deg(), 4), Fixed(group.b_nominal_deg(), 4),
                   Fixed(group.position_tolerance_mm(), 3),
                   EnumText(PositionZone_Name(group.position_zone()), "POSITION_ZONE_"),
                   Fixed(group.inclination_tolerance_deg(), 3),
                   group.has_gauge_pin() ? Fixed(group.gauge_pin().diameter_mm(), 4) : "-"});
  }
  if (!groups.empty()) std::cout << groups.ToText();
  Table datums({"datum", "point mm", "normal"});
  for (const auto& datum : part.six_points()) {
    const auto& n = datum.normal_in_part();
    datums.AddRow({datum.datum(), PointText(datum.point_in_part_mm(), 4),
                   Fixed(n.x(), 4) + ", " + Fixed(n.y(), 4) + ", " + Fixed(n.z(), 4)});
  }
  if (!datums.empty()) std::cout << datums.ToText();
  Table stations({"station", "CAD origin there mm", ">capture mm"});
  for (const auto& station : part.stations())
    stations.AddRow({station.station(), PointText(station.zero_from_part_nominal().translation_mm(), 3),
                     Fixed(station.capture_mm(), 2)});
  if (!stations.empty()) std::cout << stations.ToText();
  Table regions({"shape region", "becomes", ">allowance mm", ">lower mm", ">upper mm"});
  const auto within = [](bool has, double value) { return has ? Fixed(value, 3) : "-"; };
  for (const auto& region : part.shape_regions())
    regions.AddRow({region.region(), EnumText(ShapeRegionKind_Name(region.kind()), "SHAPE_REGION_KIND_"),
                    within(region.has_allowance_mm(), region.allowance_mm()),
                    within(region.has_lower_mm(), region.lower_mm()),
                    within(region.has_upper_mm(), region.upper_mm())});
  if (!regions.empty()) std::cout << regions.ToText();
}

}  // namespace

void AddPartCommands(Command* app, Session* session) {
  Command* part = app->AddCommand("part", "Part models: CAD, hole groups, six points, tolerances");
  part->RequireCommand();
  const auto argument = std::make_shared<std::string>(), customer = std::make_shared<std::string>(),
             solid = std::make_shared<std::string>();

  Command* add = part->AddCommand("add", "Adds a part, or a new revision of it, from a YAML file that names its CAD");
  add->AddOption("FILE", argument.get(), "YAML as docs/examples/part.yaml")->Required();
  add->AddOption(
      "--customer", customer.get(),
      "Whose part it is: seen by those alone who are cleared for customers/ID or the part; without it, as before");
  add->AddOption("--solid", solid.get(),
                 "Which solid of the CAD is the part, where it has several: its name, or its number in the file");
  session->OnCommand(add, [session, argument, customer, solid]() -> absl::Status {
    absl::StatusOr<plant::v1::CreatePartRequest> request = LoadPart(*argument);
    if (!request.ok()) return request.status();
    if (!customer->empty()) request->mutable_part()->set_customer(IdText(*customer));
    if (!solid->empty()) request->mutable_part()->set_solid(*solid);
    request->set_request_id(NewRequestId());
    const absl::StatusOr<plant::v1::Part> created =
        CallAtLength<PlantService>(session, "reading the CAD", "plant", &PlantService::Stub::CreatePart, *request);
    if (!created.ok()) return created.status();
    if (!request->part().customer().empty() && created->customer() != request->part().customer())
      return absl::FailedPreconditionError(created->name() +
                                           ": the plant took no customer, want a plant of this release (sixpoint up)");
    if (created->solid() != request->part().solid())
      return absl::FailedPreconditionError(created->name() +
                                           ": the plant took no solid, want a plant of this release (sixpoint up)");
    if (created->stations_size() != request->part().stations_size())
      return absl::FailedPreconditionError(created->name() +
                                           ": the plant took no stations, want a plant of this release (sixpoint up)");
    if (created->shape_regions_size() != request->part().shape_regions_size())
      return absl::FailedPreconditionError(
          created->name() + ": the plant took no shape_regions, want a plant of this release (sixpoint up)");
    for (int i = 0; i < created->hole_groups_size() && i < request->part().hole_groups_size(); ++i)
      if (created->hole_groups(i).position_zone() != request->part().hole_groups(i).position_zone())
        return absl::FailedPreconditionError(
            created->name() + ": the plant took no position_zone, want a plant of this release (sixpoint up)");
    PrintPart(*session, *created);
    return absl::OkStatus();
  });

  plant::v1::ListPartsRequest whole;  // groups and datums are counted
  whole.set_view(list::v1::VIEW_FULL);
  AddListCommand<PlantService>(
      part, session, "Lists the parts", "plant", &PlantService::Stub::ListParts, whole,
      Table({"part", ">revision", "customer", "cad", ">triangles", ">groups", ">datums", "since"}),
      &plant::v1::ListPartsResponse::parts, [](const plant::v1::Part& entry) {
        return Cells{IdText(entry.name()),
                     std::to_string(entry.revision()),
                     entry.customer().empty() ? "-" : entry.customer(),
                     EnumText(CadFormat_Name(entry.cad_format()), "CAD_FORMAT_"),
                     Grouped(entry.surface().triangle_count()),
                     std::to_string(entry.hole_groups_size()),
                     std::to_string(entry.six_points_size()),
                     TimeText(entry.created_at())};
      });

  Command* show = part->AddCommand("show", "Shows a part");
  show->AddOption("ID", argument.get(), "The part")->Required();
  session->OnCommand(show, [session, argument]() -> absl::Status {
    plant::v1::GetPartRequest request;
    request.set_name(NameText("parts", *argument));
    plant::v1::Part response;
    absl::Status status = session->Call<PlantService>("plant", &PlantService::Stub::GetPart, request, &response);
    if (status.ok()) PrintPart(*session, response);
    return status;
  });
}

}  // namespace sixpoint::cli
