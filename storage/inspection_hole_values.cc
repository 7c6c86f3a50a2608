#include "storage/inspection_hole_values.h"

#include <utility>

#include "storage/inspections.h"
#include "storage/optional_reals.h"
#include "storage/three.h"

namespace sixpoint::storage {
namespace {

// A hole's numbers come in one column each; kHoleNumbers of them from $6 on, then both budgets, then those of the stated positioning.
constexpr char kInsertHoleValues[] =
    "INSERT INTO inspection_hole_values (inspection_id, position_index, measured_by, along_is, diameter_reason, "
    "along_in_part, across_in_part, along_um, along_expanded_uncertainty_um, across_um, "
    "across_expanded_uncertainty_um, inclination_along_deg, inclination_along_expanded_uncertainty_deg, "
    "inclination_across_deg, inclination_across_expanded_uncertainty_deg, pin_diameter_expanded_uncertainty_um, "
    "diameter_mm, diameter_expanded_uncertainty_um, along_budget_um, across_budget_um, "
    "position_stated_expanded_uncertainty_um, inclination_stated_expanded_uncertainty_deg, "
    "positioning_difference_deg, displacement_covariance_um2, displacement_coverage_factor) SELECT $1::uuid, "
    "hole::integer, measured_by, along_is, reason, ARRAY[ax, ay, az], ARRAY[cx, cy, cz], n1, n2, n3, n4, n5, n6, n7, "
    "n8, n9, n10, n11, nullif(along_budget, '')::real[], nullif(across_budget, '')::real[], s1, s2, s3, CASE WHEN s4 "
    "IS "
    "NOT NULL THEN ARRAY[s4, s5, s6] END, s7 FROM "
    "unnest($2::double precision[], $3::text[], $4::text[], $5::text[], $6::double precision[], "
    "$7::double precision[], $8::double precision[], $9::double precision[], $10::double precision[], "
    "$11::double precision[], $12::double precision[], $13::double precision[], $14::double precision[], "
    "$15::double precision[], $16::double precision[], $17::double precision[], $18::double precision[], "
    "$19::double precision[], $20::double precision[], $21::double precision[], $22::double precision[], "
    "$23::text[], $24::text[], $25::double precision[], $26::double precision[], $27::double precision[], "
    "$28::double precision[], $29::double precision[], $30::double precision[], $31::double precision[]) AS holes "
    "(hole, measured_by, along_is, reason, ax, ay, az, cx, cy, cz, n1, n2, n3, n4, "
    "n5, n6, n7, n8, n9, n10, n11, along_budget, across_budget, s1, s2, s3, s4, s5, s6, s7)";
constexpr std::size_t kHoleNumbers = 17, kStatedNumbers = 7;
constexpr char kSelectHoleValues[] =
    "SELECT inspection_id, position_index, measured_by, along_is, diameter_reason, along_in_part, across_in_part, "
    "along_um, along_expanded_uncertainty_um, across_um, across_expanded_uncertainty_um, inclination_along_deg, "
    "inclination_along_expanded_uncertainty_deg, inclination_across_deg, "
    "inclination_across_expanded_uncertainty_deg, pin_diameter_expanded_uncertainty_um, diameter_mm, "
    "diameter_expanded_uncertainty_um, along_budget_um, across_budget_um, position_stated_expanded_uncertainty_um, "
    "inclination_stated_expanded_uncertainty_deg, positioning_difference_deg, displacement_covariance_um2, "
    "displacement_coverage_factor FROM inspection_hole_values WHERE "
    "inspection_id = ANY ($1::uuid[]) ORDER BY inspection_id, position_index";
constexpr char kInsertPitches[] =
    "INSERT INTO inspection_pitches (inspection_id, position_index, hole_index, next_index, reason, nominal_pitch_mm, "
    "pitch_mm, pitch_expanded_uncertainty_um, pitch_over_diameter, pitch_over_diameter_expanded_uncertainty, "
    "budget_um) SELECT $1::uuid, (position - 1)::integer, hole::integer, next::integer, reason, nominal, pitch, "
    "expanded, ratio, ratio_expanded, nullif(budget, '')::real[] FROM unnest($2::double precision[], "
    "$3::double precision[], $4::text[], $5::double precision[], $6::double precision[], $7::double precision[], "
    "$8::double precision[], $9::double precision[], $10::text[]) WITH ORDINALITY AS pitches (hole, next, reason, "
    "nominal, pitch, expanded, ratio, ratio_expanded, budget, position)";
constexpr char kSelectPitches[] =
    "SELECT inspection_id, hole_index, next_index, reason, nominal_pitch_mm, pitch_mm, pitch_expanded_uncertainty_um, "
    "pitch_over_diameter, pitch_over_diameter_expanded_uncertainty, budget_um FROM inspection_pitches WHERE "
    "inspection_id = ANY ($1::uuid[]) ORDER BY inspection_id, position_index";

using Numbers = std::vector<std::optional<double>>;

void AddStated(const std::optional<StatedPositioningRow>& row, std::vector<Numbers>* columns) {
  std::size_t column = 0;
  for (const auto number :
       {&StatedPositioningRow::position_expanded_uncertainty_um,
        &StatedPositioningRow::inclination_expanded_uncertainty_deg, &StatedPositioningRow::positioning_difference_deg,
        &StatedPositioningRow::along_variance_um2, &StatedPositioningRow::covariance_um2,
        &StatedPositioningRow::across_variance_um2, &StatedPositioningRow::coverage_factor})
    (*columns)[column++].push_back(row ? std::optional<double>((*row).*number) : std::nullopt);
}

Params HoleValuesParams(const InspectionRow& inspection) {
  std::vector<double> places;
  std::vector<std::string> measured_by, along_is, reasons, along_budgets, across_budgets;
  std::vector<Numbers> numbers(kHoleNumbers), stated(kStatedNumbers);
  for (std::size_t i = 0; i < inspection.holes.size(); ++i) {
    if (!inspection.holes[i].values) continue;
    const HoleDetailRow& values = *inspection.holes[i].values;
    places.push_back(static_cast<double>(i));
    measured_by.push_back(values.measured_by);
    along_is.push_back(values.along_is);
    reasons.push_back(values.diameter_reason);
    along_budgets.push_back(ArrayText(values.along_um.budget_um));
    across_budgets.push_back(ArrayText(values.across_um.budget_um));
    std::size_t column = 0;
    for (const auto* three : {&values.along_in_part, &values.across_in_part})
      for (const double one : *three) numbers[column++].push_back(one);
    for (const StatedValueRow* value :
         {&values.along_um, &values.across_um, &values.inclination_along_deg, &values.inclination_across_deg}) {
      numbers[column++].push_back(value->value);
      numbers[column++].push_back(value->expanded_uncertainty);
    }
    numbers[column++].push_back(values.pin_diameter_expanded_uncertainty_um);
    numbers[column++].push_back(values.diameter_mm);
    numbers[column++].push_back(values.diameter_expanded_uncertainty_um);
    AddStated(values.in_stated_positioning, &stated);
  }
  Params params;
  params.Uuid(inspection.inspection_id).Reals(places).Texts(measured_by).Texts(along_is).Texts(reasons);
  for (const Numbers& column : numbers) params.OptionalReals(column);
  params.Texts(along_budgets).Texts(across_budgets);
  for (const Numbers& column : stated) params.OptionalReals(column);
  return params;
}

HoleDetailRow ReadHoleDetail(const Rows& rows, int row) {
  HoleDetailRow values;
  values.measured_by = rows.Text(row, 2);
  values.along_is = rows.Text(row, 3);
  values.diameter_reason = rows.Text(row, 4);
  values.along_in_part = ThreeOf(rows.Reals(row, 5));
  values.across_in_part = ThreeOf(rows.Reals(row, 6));
  values.along_um = {rows.Real(row, 7), rows.Real(row, 8), OptionalRealsAt(rows, row, 18)};
  values.across_um = {rows.Real(row, 9), rows.Real(row, 10), OptionalRealsAt(rows, row, 19)};
  values.inclination_along_deg = {rows.Real(row, 11), rows.Real(row, 12)};
  values.inclination_across_deg = {rows.Real(row, 13), rows.Real(row, 14)};
  values.pin_diameter_expanded_uncertainty_um = rows.OptionalReal(row, 15);
  values.diameter_mm = rows.OptionalReal(row, 16);
  values.diameter_expanded_uncertainty_um = rows.OptionalReal(row, 17);
  if (!rows.IsNull(row, 20)) {
    const std::array<double, 3> covariance_um2 = ThreeOf(rows.Reals(row, 23));
    values.in_stated_positioning =
        StatedPositioningRow{rows.Real(row, 20), rows.Real(row, 21), rows.Real(row, 22), covariance_um2[0],
                             covariance_um2[2],  covariance_um2[1],  rows.Real(row, 24)};
  }
  return values;
}

Params PitchesParams(const InspectionRow& inspection) {
  std::vector<double> holes, nexts;
  std::vector<std::string> reasons, budgets;
  Numbers nominals, pitches, expanded, ratios, ratios_expanded;
  for (const HolePitchRow& pitch : inspection.pitches) {
    holes.push_back(pitch.hole_index);
    nexts.push_back(pitch.next_index);
    reasons.push_back(pitch.reason);
    nominals.push_back(pitch.nominal_pitch_mm);
    const auto add = [&](Numbers* column, const auto& of) {
      column->push_back(pitch.measured ? std::optional<double>(of(*pitch.measured)) : std::nullopt);
    };
    using Measured = HolePitchRow::Measured;
    add(&pitches, [](const Measured& m) { return m.pitch_mm.value; });
    add(&expanded, [](const Measured& m) { return m.pitch_mm.expanded_uncertainty; });
    add(&ratios, [](const Measured& m) { return m.pitch_over_diameter; });
    add(&ratios_expanded, [](const Measured& m) { return m.pitch_over_diameter_expanded_uncertainty; });
    budgets.push_back(pitch.measured ? ArrayText(pitch.measured->pitch_mm.budget_um) : "");
  }
  Params params;
  params.Uuid(inspection.inspection_id).Reals(holes).Reals(nexts).Texts(reasons).OptionalReals(nominals);
  params.OptionalReals(pitches).OptionalReals(expanded).OptionalReals(ratios).OptionalReals(ratios_expanded);
  return params.Texts(budgets);
}

HolePitchRow ReadPitch(const Rows& rows, int row) {
  HolePitchRow pitch;
  pitch.hole_index = static_cast<int>(rows.Int(row, 1));
  pitch.next_index = static_cast<int>(rows.Int(row, 2));
  pitch.reason = rows.Text(row, 3);
  pitch.nominal_pitch_mm = rows.Real(row, 4);
  if (!rows.IsNull(row, 5))
    pitch.measured = HolePitchRow::Measured{
        {rows.Real(row, 5), rows.Real(row, 6), OptionalRealsAt(rows, row, 9)}, rows.Real(row, 7), rows.Real(row, 8)};
  return pitch;
}

}  // namespace

absl::Status InsertHoleValues(Transaction& transaction, const InspectionRow& inspection) {
  absl::Status status = transaction.Execute(kInsertHoleValues, HoleValuesParams(inspection)).status();
  if (status.ok() && !inspection.pitches.empty())
    status = transaction.Execute(kInsertPitches, PitchesParams(inspection)).status();
  return status;
}

absl::Status ReadHoleValues(Transaction& transaction, const ParentRows<InspectionRow>& inspections) {
  const Params ids = Params().Uuids(inspections.ids());
  bool of_holes = true;
  absl::Status read = inspections.Add(transaction.Execute(kSelectHoleValues, ids),
                                      [&](InspectionRow& inspection, const Rows& rows, int row) {
                                        const auto index = static_cast<std::size_t>(rows.Int(row, 1));
                                        of_holes = of_holes && index < inspection.holes.size();
                                        if (of_holes) inspection.holes[index].values = ReadHoleDetail(rows, row);
                                      });
  if (read.ok())
    read = inspections.Add(transaction.Execute(kSelectPitches, ids),
                           [&](InspectionRow& inspection, const Rows& rows, int row) {
                             HolePitchRow pitch = ReadPitch(rows, row);
                             of_holes = of_holes && pitch.hole_index < static_cast<int>(inspection.holes.size()) &&
                                        pitch.next_index < static_cast<int>(inspection.holes.size());
                             inspection.pitches.push_back(std::move(pitch));
                           });
  if (read.ok() && !of_holes) return absl::DataLossError("inspection_hole_values or inspection_pitches: of no hole");
  return read;
}

}  // namespace sixpoint::storage
