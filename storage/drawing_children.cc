#include "storage/drawing_children.h"

#include <map>

#include "storage/each_row.h"
#include "storage/optional_reals.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertDrawingRegion[] =
    "INSERT INTO drawing_regions (drawing_id, revision, position_index, region, minimum_in_part_mm, "
    "maximum_in_part_mm, facing_in_part, facing_within_deg) VALUES ($1, $2, $3, $4, $5, $6, $7, $8)";
constexpr char kSelectDrawingRegions[] =
    "SELECT region, minimum_in_part_mm, maximum_in_part_mm, facing_in_part, facing_within_deg FROM drawing_regions "
    "WHERE drawing_id = $1 AND revision = $2 ORDER BY position_index";
constexpr char kInsertDatumSystem[] =
    "INSERT INTO drawing_datum_systems (drawing_id, revision, position_index, datum_system, positioning, region) "
    "VALUES ($1, $2, $3, $4, $5, $6)";
constexpr char kSelectDatumSystems[] =
    "SELECT datum_system, positioning, region FROM drawing_datum_systems WHERE drawing_id = $1 AND revision = $2 "
    "ORDER BY position_index";
constexpr char kInsertDrawingDatum[] =
    "INSERT INTO drawing_datums (drawing_id, revision, datum_system, position_index, datum, datum_points) "
    "VALUES ($1, $2, $3, $4, $5, $6)";
constexpr char kSelectDrawingDatums[] =
    "SELECT datum_system, datum, datum_points FROM drawing_datums WHERE drawing_id = $1 AND revision = $2 "
    "ORDER BY datum_system, position_index";
constexpr char kInsertDrawingSection[] =
    "INSERT INTO drawing_sections (drawing_id, revision, position_index, section, height_mm, origin_in_part_mm, "
    "normal_in_part, reference_in_part, leading_in_part_mm, near_in_part_mm, half_width_mm) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11)";
constexpr char kSelectDrawingSections[] =
    "SELECT section, height_mm, origin_in_part_mm, normal_in_part, reference_in_part, leading_in_part_mm, "
    "near_in_part_mm, half_width_mm FROM drawing_sections WHERE drawing_id = $1 AND revision = $2 "
    "ORDER BY position_index";
#define SIXPOINT_CHARACTERISTIC_COLUMNS                                                                         \
  "characteristic, name, requirement, reference_location, class, designator, quantity, algorithm, hole_group, " \
  "hole, to_hole, along_in_part, section, reference_section, region, unit, nominal, lower_limit, upper_limit, " \
  "zone, datum_system, least_coverage, decision_rule, decision_rule_edition, guard_factor, gauge, designed_tooling"
constexpr char kInsertCharacteristic[] =
    "INSERT INTO drawing_characteristics (drawing_id, revision, position_index, " SIXPOINT_CHARACTERISTIC_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, "
    "$23, $24, $25, $26, $27, $28, $29, $30)";
constexpr char kSelectCharacteristics[] =
    "SELECT " SIXPOINT_CHARACTERISTIC_COLUMNS
    " FROM drawing_characteristics WHERE drawing_id = $1 AND revision = $2 ORDER BY position_index";
#undef SIXPOINT_CHARACTERISTIC_COLUMNS
constexpr char kInsertRequirement[] =
    "INSERT INTO drawing_product_requirements (drawing_id, revision, position_index, kind, requirement, "
    "specification, code, customer_approval) VALUES ($1, $2, $3, $4, $5, $6, $7, $8)";
constexpr char kSelectRequirements[] =
    "SELECT kind, requirement, specification, code, customer_approval FROM drawing_product_requirements "
    "WHERE drawing_id = $1 AND revision = $2 ORDER BY position_index";

// In the order of their columns, to along_in_part, to unit, and those after the limits.
constexpr std::string CharacteristicRow::*kSaid[] = {&CharacteristicRow::characteristic,
                                                     &CharacteristicRow::name,
                                                     &CharacteristicRow::requirement,
                                                     &CharacteristicRow::reference_location,
                                                     &CharacteristicRow::characteristic_class,
                                                     &CharacteristicRow::designator,
                                                     &CharacteristicRow::quantity,
                                                     &CharacteristicRow::algorithm,
                                                     &CharacteristicRow::hole_group,
                                                     &CharacteristicRow::hole,
                                                     &CharacteristicRow::to_hole};
constexpr std::string CharacteristicRow::*kPlaced[] = {&CharacteristicRow::section,
                                                       &CharacteristicRow::reference_section,
                                                       &CharacteristicRow::region, &CharacteristicRow::unit};

Params Begin(const DrawingRow& drawing) {
  Params params;
  params.Text(drawing.drawing_id).Int(drawing.revision);
  return params;
}

absl::Status InsertDatumSystems(Transaction& transaction, const DrawingRow& drawing) {
  int index = 0;
  for (const DatumSystemRow& system : drawing.datum_systems) {
    Params params = Begin(drawing);
    params.Int(index++).Text(system.datum_system).Text(system.positioning).OptionalText(system.region);
    if (const auto put = transaction.Execute(kInsertDatumSystem, params); !put.ok()) return put.status();
    int position = 0;
    for (const DatumRow& datum : system.datums) {
      Params row = Begin(drawing);
      row.Text(system.datum_system).Int(position++).Text(datum.datum).Texts(datum.datum_points);
      if (const auto put = transaction.Execute(kInsertDrawingDatum, row); !put.ok()) return put.status();
    }
  }
  return absl::OkStatus();
}

absl::Status InsertPlaces(Transaction& transaction, const DrawingRow& drawing) {
  int index = 0;
  for (const DrawingRegionRow& region : drawing.regions) {
    Params params = Begin(drawing);
    params.Int(index++).Text(region.region);
    for (const auto* const values : {&region.minimum_in_part_mm, &region.maximum_in_part_mm, &region.facing_in_part})
      AddOptionalReals(*values, &params);
    params.OptionalReal(region.facing_within_deg);
    if (const auto put = transaction.Execute(kInsertDrawingRegion, params); !put.ok()) return put.status();
  }
  index = 0;
  for (const DrawingSectionRow& section : drawing.sections) {
    Params params = Begin(drawing);
    params.Int(index++).Text(section.section).OptionalReal(section.height_mm);
    for (const auto* const values : {&section.origin_in_part_mm, &section.normal_in_part, &section.reference_in_part,
                                     &section.leading_in_part_mm, &section.near_in_part_mm})
      AddOptionalReals(*values, &params);
    params.Real(section.half_width_mm);
    if (const auto put = transaction.Execute(kInsertDrawingSection, params); !put.ok()) return put.status();
  }
  return absl::OkStatus();
}

absl::Status InsertCharacteristics(Transaction& transaction, const DrawingRow& drawing) {
  int index = 0;
  for (const CharacteristicRow& one : drawing.characteristics) {
    Params params = Begin(drawing);
    params.Int(index++);
    for (const auto text : kSaid) params.OptionalText(one.*text);
    AddOptionalReals(one.along_in_part, &params);
    for (const auto text : kPlaced) params.OptionalText(one.*text);
    params.OptionalReal(one.nominal).OptionalReal(one.lower_limit).OptionalReal(one.upper_limit);
    params.OptionalText(one.zone).OptionalText(one.datum_system).OptionalReal(one.least_coverage);
    Add(one.decision_rule, &params);
    params.OptionalText(one.gauge).OptionalText(one.designed_tooling);
    if (const auto put = transaction.Execute(kInsertCharacteristic, params); !put.ok()) return put.status();
  }
  return absl::OkStatus();
}

absl::Status InsertRequirements(Transaction& transaction, const DrawingRow& drawing) {
  int index = 0;
  for (const ProductRequirementRow& one : drawing.product_requirements) {
    Params params = Begin(drawing);
    params.Int(index++).Text(one.kind).Text(one.requirement).Text(one.specification).OptionalText(one.code);
    const auto put = transaction.Execute(kInsertRequirement, params.Bool(one.customer_approval));
    if (!put.ok()) return put.status();
  }
  return absl::OkStatus();
}

absl::Status ReadDatumSystems(Transaction& transaction, DrawingRow* drawing) {
  std::map<std::string, std::vector<DatumRow>> datums;
  const absl::Status read = EachRow(transaction, kSelectDrawingDatums, Begin(*drawing), [&](const Rows& rows, int row) {
    datums[rows.Text(row, 0)].push_back({rows.Text(row, 1), rows.Texts(row, 2)});
  });
  if (!read.ok()) return read;
  return EachRow(transaction, kSelectDatumSystems, Begin(*drawing), [&](const Rows& rows, int row) {
    const std::string system = rows.Text(row, 0);
    drawing->datum_systems.push_back({system, rows.Text(row, 1), rows.OptionalText(row, 2), datums[system]});
  });
}

CharacteristicRow CharacteristicAt(const Rows& rows, int row) {
  CharacteristicRow one;
  int column = 0;
  for (const auto text : kSaid) one.*text = rows.OptionalText(row, column++);
  one.along_in_part = OptionalRealsAt(rows, row, column++);
  for (const auto text : kPlaced) one.*text = rows.OptionalText(row, column++);
  for (auto* const figure : {&one.nominal, &one.lower_limit, &one.upper_limit})
    *figure = rows.OptionalReal(row, column++);
  one.zone = rows.OptionalText(row, column++);
  one.datum_system = rows.OptionalText(row, column++);
  one.least_coverage = rows.OptionalReal(row, column++);
  one.decision_rule = DecisionRuleAt(rows, row, column);
  one.gauge = rows.OptionalText(row, column + 3);
  one.designed_tooling = rows.OptionalText(row, column + 4);
  return one;
}

absl::Status ReadSections(Transaction& transaction, DrawingRow* drawing) {
  return EachRow(transaction, kSelectDrawingSections, Begin(*drawing), [&](const Rows& rows, int row) {
    DrawingSectionRow& section = drawing->sections.emplace_back();
    section.section = rows.Text(row, 0);
    section.height_mm = rows.OptionalReal(row, 1);
    int column = 2;
    for (auto* const values : {&section.origin_in_part_mm, &section.normal_in_part, &section.reference_in_part,
                               &section.leading_in_part_mm, &section.near_in_part_mm})
      *values = OptionalRealsAt(rows, row, column++);
    section.half_width_mm = rows.Real(row, column);
  });
}

}  // namespace

absl::Status InsertDrawingChildren(Transaction& transaction, const DrawingRow& drawing) {
  for (const auto insert : {InsertPlaces, InsertDatumSystems, InsertCharacteristics, InsertRequirements})
    if (absl::Status put = insert(transaction, drawing); !put.ok()) return put;
  return absl::OkStatus();
}

absl::Status ReadDrawingChildren(Transaction& transaction, DrawingRow* drawing) {
  absl::Status read = EachRow(transaction, kSelectDrawingRegions, Begin(*drawing), [&](const Rows& rows, int row) {
    drawing->regions.push_back({rows.Text(row, 0), OptionalRealsAt(rows, row, 1), OptionalRealsAt(rows, row, 2),
                                OptionalRealsAt(rows, row, 3), rows.OptionalReal(row, 4)});
  });
  for (const auto more : {ReadDatumSystems, ReadSections})
    if (read.ok()) read = more(transaction, drawing);
  if (!read.ok()) return read;
  read = EachRow(transaction, kSelectCharacteristics, Begin(*drawing),
                 [&](const Rows& rows, int row) { drawing->characteristics.push_back(CharacteristicAt(rows, row)); });
  if (!read.ok()) return read;
  return EachRow(transaction, kSelectRequirements, Begin(*drawing), [&](const Rows& rows, int row) {
    drawing->product_requirements.push_back(
        {rows.Text(row, 0), rows.Text(row, 1), rows.Text(row, 2), rows.OptionalText(row, 3), rows.Bool(row, 4)});
  });
}

}  // namespace sixpoint::storage
