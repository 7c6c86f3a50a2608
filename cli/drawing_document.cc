#include "cli/drawing_document.h"

#include <optional>

#include "cli/document.h"
#include "cli/list_filters.h"
#include "cli/output.h"
#include "cli/region_document.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kMostCharacteristics = 2000, kMostRevisions = 32, kMostPlaces = 64, kMostRequirements = 200;
constexpr std::size_t kMostRequirement_bytes = 1000;
constexpr std::int64_t kGreatestRevision = 999'999'999;

// The contract's word in small letters.
template <typename Enum>
Enum Word(const Field& field) {
  const auto& values = *google::protobuf::GetEnumDescriptor<Enum>();
  return static_cast<Enum>(ValueOf(values, field.Choice(WordsOf(values))));
}

template <typename Message>
void ReadPoint(const Field& field, const char* key, geometry::v1::Point* (Message::*mutable_point)(), Message* out) {
  const std::optional<Field> found = field.Find(key);
  if (!found) return;
  const Eigen::Vector3d point_mm = found->Vector3();
  geometry::v1::Point* const to = (out->*mutable_point)();
  to->set_x_mm(point_mm.x());
  to->set_y_mm(point_mm.y());
  to->set_z_mm(point_mm.z());
}

// Of any length: people write [1, 1, 0].
void ReadDirection(const Field& field, geometry::v1::Direction* out) {
  const Eigen::Vector3d direction = field.Vector3();
  if (!(direction.norm() > 0)) return field.Refuse("a direction");
  out->set_x(direction.normalized().x());
  out->set_y(direction.normalized().y());
  out->set_z(direction.normalized().z());
}

void ReadDatumSystem(const Field& system, plant::v1::DatumSystem* out) {
  system.OnlyKeys({"datum_system", "positioning", "region", "datums"});
  out->set_datum_system(system.At("datum_system").Text());
  out->set_positioning(Word<plant::v1::DatumPositioning>(system.At("positioning")));
  out->set_region(TextAt(system, "region"));
  for (const Field& one : system.At("datums").Items(1, 3)) {
    one.OnlyKeys({"datum", "datum_points"});
    plant::v1::Datum* const datum = out->add_datums();
    datum->set_datum(one.At("datum").Text());
    if (const auto points = one.Find("datum_points"))
      for (const Field& point : points->Items(1, 6)) datum->add_datum_points(point.Text());
  }
}

void ReadSection(const Field& section, plant::v1::DrawingSection* out) {
  using Section = plant::v1::DrawingSection;
  section.OnlyKeys({"section", "height_mm", "origin_in_part_mm", "normal_in_part", "reference_in_part",
                    "leading_in_part_mm", "near_in_part_mm", "half_width_mm"});
  out->set_section(section.At("section").Text());
  if (const auto height = section.Find("height_mm")) out->set_height_mm(height->Number());
  ReadPoint(section, "origin_in_part_mm", &Section::mutable_origin_in_part_mm, out);
  ReadPoint(section, "leading_in_part_mm", &Section::mutable_leading_in_part_mm, out);
  ReadPoint(section, "near_in_part_mm", &Section::mutable_near_in_part_mm, out);
  if (const auto normal = section.Find("normal_in_part")) ReadDirection(*normal, out->mutable_normal_in_part());
  if (const auto along = section.Find("reference_in_part")) ReadDirection(*along, out->mutable_reference_in_part());
  out->set_half_width_mm(section.At("half_width_mm").Positive());
}

void ReadDrawingRegion(const Field& region, plant::v1::DrawingRegion* out) {
  region.OnlyKeys(RegionKeys());
  ReadRegion(region, out);
}

void ReadNeighbour(const Field& neighbour, plant::v1::DrawingNeighbour* out) {
  using Neighbour = plant::v1::DrawingNeighbour;
  neighbour.OnlyKeys({"offset_in_part_mm", "standard_uncertainty_um"});
  neighbour.At("offset_in_part_mm");
  ReadPoint(neighbour, "offset_in_part_mm", &Neighbour::mutable_offset_in_part_mm, out);
  out->set_standard_uncertainty_um(neighbour.At("standard_uncertainty_um").Number());
}

void ReadPlace(const Field& one, plant::v1::Characteristic* out) {
  out->set_hole_group(TextAt(one, "hole_group"));
  out->set_hole(TextAt(one, "hole"));
  out->set_to_hole(TextAt(one, "to_hole"));
  if (const auto along = one.Find("along_in_part")) ReadDirection(*along, out->mutable_along_in_part());
  out->set_section(TextAt(one, "section"));
  out->set_reference_section(TextAt(one, "reference_section"));
  out->set_region(TextAt(one, "region"));
}

void ReadCharacteristic(const Field& one, plant::v1::Characteristic* out) {
  one.OnlyKeys({"characteristic",  "name",
                "requirement",     "reference_location",
                "class",           "designator",
                "quantity",        "algorithm",
                "hole_group",      "hole",
                "to_hole",         "along_in_part",
                "section",         "reference_section",
                "region",          "unit",
                "nominal",         "lower_limit",
                "upper_limit",     "zone",
                "datum_system",    "least_coverage",
                "decision_rule",   "gauge",
                "designed_tooling"});
  out->set_characteristic(one.At("characteristic").Text());
  out->set_name(one.At("name").Text());
  out->set_requirement(one.At("requirement").Lines(kMostRequirement_bytes));
  out->set_reference_location(one.At("reference_location").Text());
  out->set_characteristic_class(Word<plant::v1::CharacteristicClass>(one.At("class")));
  out->set_designator(TextAt(one, "designator"));
  out->set_quantity(Word<plant::v1::CharacteristicQuantity>(one.At("quantity")));
  if (const auto word = one.Find("algorithm")) out->set_algorithm(Word<plant::v1::CharacteristicAlgorithm>(*word));
  ReadPlace(one, out);
  out->set_unit(Word<plant::v1::CharacteristicUnit>(one.At("unit")));
  if (const auto figure = one.Find("nominal")) out->set_nominal(figure->Number());
  if (const auto figure = one.Find("lower_limit")) out->set_lower_limit(figure->Number());
  if (const auto figure = one.Find("upper_limit")) out->set_upper_limit(figure->Number());
  if (const auto word = one.Find("zone")) out->set_zone(Word<plant::v1::ToleranceZone>(*word));
  out->set_datum_system(TextAt(one, "datum_system"));
  if (const auto coverage = one.Find("least_coverage")) out->set_least_coverage(coverage->Number());
  if (const auto rule = one.Find("decision_rule")) ReadDecisionRule(*rule, out->mutable_decision_rule());
  out->set_gauge(TextAt(one, "gauge"));
  out->set_designed_tooling(TextAt(one, "designed_tooling"));
}

void ReadRequirement(const Field& one, plant::v1::ProductRequirement* out) {
  one.OnlyKeys({"kind", "requirement", "specification", "code", "customer_approval"});
  out->set_kind(Word<plant::v1::ProductRequirementKind>(one.At("kind")));
  out->set_requirement(one.At("requirement").Text());
  out->set_specification(one.At("specification").Text());
  out->set_code(TextAt(one, "code"));
  if (const auto approval = one.Find("customer_approval")) out->set_customer_approval(approval->Flag());
}

void ReadTitle(const Field& root, plant::v1::Drawing* out) {
  out->set_part(NameText("parts", root.At("part").Text()));
  for (const Field& revision : root.At("part_revisions").Items(1, kMostRevisions))
    out->add_part_revisions(static_cast<int>(revision.Whole(1, kGreatestRevision)));
  out->set_drawing_number(root.At("drawing_number").Text());
  out->set_drawing_revision(root.At("drawing_revision").Text());
  out->set_part_number(root.At("part_number").Text());
  out->set_part_name(root.At("part_name").Text());
  out->set_part_revision_level(TextAt(root, "part_revision_level"));
  if (const auto changes = root.Find("additional_changes"))
    for (const Field& change : changes->Items(1, kMostRevisions)) out->add_additional_changes(change.Text());
}

// Each item of a list that may be left out.
template <typename Read, typename Messages>
void ReadList(const Field& root, const char* key, std::size_t most, const Read& read, Messages* out) {
  const std::optional<Field> list = root.Find(key);
  if (!list) return;
  for (const Field& one : list->Items(1, most)) read(one, out->Add());
}

}  // namespace

void ReadDecisionRule(const Field& rule, plant::v1::DecisionRule* out) {
  rule.OnlyKeys({"kind", "edition", "guard_factor"});
  out->set_kind(Word<plant::v1::DecisionRuleKind>(rule.At("kind")));
  out->set_edition(TextAt(rule, "edition"));
  if (const auto factor = rule.Find("guard_factor")) out->set_guard_factor(factor->Number());
}

absl::StatusOr<plant::v1::CreateDrawingRequest> LoadDrawing(const std::string& path) {
  const absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, "", &problems);
  root.OnlyKeys({"id", "part", "part_revisions", "drawing_number", "drawing_revision", "part_number", "part_name",
                 "part_revision_level", "additional_changes", "decision_rule", "datum_systems", "sections", "regions",
                 "neighbour", "characteristics", "product_requirements"});
  plant::v1::CreateDrawingRequest request;
  request.set_drawing_id(root.At("id").Id());
  plant::v1::Drawing& drawing = *request.mutable_drawing();
  ReadTitle(root, &drawing);
  ReadDecisionRule(root.At("decision_rule"), drawing.mutable_decision_rule());
  ReadList(root, "datum_systems", kMostRevisions, ReadDatumSystem, drawing.mutable_datum_systems());
  ReadList(root, "sections", kMostRevisions, ReadSection, drawing.mutable_sections());
  ReadList(root, "regions", kMostPlaces, ReadDrawingRegion, drawing.mutable_regions());
  if (const auto neighbour = root.Find("neighbour")) ReadNeighbour(*neighbour, drawing.mutable_neighbour());
  for (const Field& one : root.At("characteristics").Items(1, kMostCharacteristics))
    ReadCharacteristic(one, drawing.add_characteristics());
  ReadList(root, "product_requirements", kMostRequirements, ReadRequirement, drawing.mutable_product_requirements());
  if (!problems.empty()) return problems.ToStatus();
  return request;
}

}  // namespace sixpoint::cli
