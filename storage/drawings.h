// Drawings as data: what each asks of its part, balloon by balloon. A drawing is of one part, and has revisions that never change, as what
// stands in plant_registry.h.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/decision_rules.h"
#include "storage/plant_registry.h"
#include "storage/record.h"

namespace sixpoint::storage {

// Words are those of the contract, without the names of their enums. An empty text is none; vectors are of 3, or empty where nothing is said.
struct DatumRow {
  std::string datum;
  std::vector<std::string> datum_points;
};

struct DatumSystemRow {
  std::string datum_system, positioning, region;
  std::vector<DatumRow> datums;
};

struct DrawingSectionRow {
  std::string section;
  std::optional<double> height_mm;
  std::vector<double> origin_in_part_mm, normal_in_part, reference_in_part, leading_in_part_mm, near_in_part_mm;
  double half_width_mm = 0;
};

struct DrawingRegionRow {
  std::string region;
  std::vector<double> minimum_in_part_mm, maximum_in_part_mm, facing_in_part;
  std::optional<double> facing_within_deg;
};

struct CharacteristicRow {
  std::string characteristic, name, requirement, reference_location;
  std::string characteristic_class, designator, quantity, algorithm;
  std::string hole_group, hole, to_hole;
  std::vector<double> along_in_part;
  std::string section, reference_section, region;
  std::string unit;  // of the next three
  std::optional<double> nominal, lower_limit, upper_limit;
  std::string zone, datum_system;
  std::optional<double> least_coverage;
  DecisionRuleRow decision_rule;
  std::string gauge, designed_tooling;
};

struct ProductRequirementRow {
  std::string kind, requirement, specification, code;
  bool customer_approval = false;
};

struct DrawingRow {
  std::string drawing_id;
  int revision = 0;  // set by InsertDrawing, as `recorded`
  std::string content_sha256;
  std::string part_id;
  std::vector<int> part_revisions;  // ascending
  std::string drawing_number, drawing_revision, part_number, part_name, part_revision_level;
  std::vector<std::string> additional_changes;
  DecisionRuleRow decision_rule;
  std::vector<double> neighbour_offset_in_part_mm;
  double neighbour_standard_uncertainty_um = 0;
  int characteristic_count = 0;  // of lists too, which leave out all from here on
  std::vector<DatumSystemRow> datum_systems;
  std::vector<DrawingSectionRow> sections;
  std::vector<DrawingRegionRow> regions;
  std::vector<CharacteristicRow> characteristics;
  std::vector<ProductRequirementRow> product_requirements;
  std::string requested_by;
  std::optional<int> revises;  // of an order alone: the newest revision, as whoever wrote it knew it; 0: none
  Recorded recorded;
};

// As InsertMachine. ALREADY_EXISTS: the drawing is another part's; PERMISSION_DENIED (CLEARANCE_MISSING) where entry.reader may not see that
// one. INVALID_ARGUMENT: another revision than `revises` is the newest.
absl::StatusOr<DrawingRow> InsertDrawing(Transaction& transaction, DrawingRow drawing, RecordEntry entry);
// Revision 0: the newest.
absl::StatusOr<std::optional<DrawingRow>> FindDrawing(Transaction& transaction, const std::string& id, int revision);
// The same as a list has it.
absl::StatusOr<std::optional<DrawingRow>> FindListedDrawing(Transaction& transaction, const std::string& id,
                                                            int revision);
// As ListRegistered.
absl::StatusOr<std::vector<std::string>> ListDrawingIds(Transaction& transaction, const RegisteredFilter& filter,
                                                        const std::string& after, int limit);

}  // namespace sixpoint::storage
