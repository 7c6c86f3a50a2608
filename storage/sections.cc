#include "storage/sections.h"

#include <utility>

#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/optional_reals.h"
#include "storage/postgres_results.h"
#include "storage/scan_keys.h"
#include "storage/three.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_MEASUREMENT_COLUMNS                                                                          \
  "section_measurement_id, blade_serial, registration_id, machine_id, machine_revision, part_id, "            \
  "part_revision, sensor_calibration_id, rotation_calibration_id, method, half_width_mm, reference_section, " \
  "neighbour_offset_in_part_mm, neighbour_standard_uncertainty_um, outlines_sha256, requested_by, "           \
  "software_version, computed_on"
constexpr char kInsertSectionMeasurement[] =
    "INSERT INTO section_measurements (" SIXPOINT_MEASUREMENT_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18)";
#define SIXPOINT_SELECT_MEASUREMENTS                                                          \
  "SELECT " SIXPOINT_MEASUREMENT_COLUMNS                                                      \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation FROM " \
  "section_measurements JOIN recorded r ON r.record_id = section_measurement_id WHERE "
constexpr char kSelectSectionMeasurement[] = SIXPOINT_SELECT_MEASUREMENTS "section_measurement_id = $1";
constexpr char kListSectionMeasurements[] = SIXPOINT_SELECT_MEASUREMENTS SIXPOINT_RESULT_FILTER(
    "section_measurements", "section") SIXPOINT_NEWEST_FIRST "LIMIT $10";
#undef SIXPOINT_SELECT_MEASUREMENTS
#undef SIXPOINT_MEASUREMENT_COLUMNS
constexpr char kInsertSectionScans[] =
    "INSERT INTO section_measurement_scans (section_measurement_id, position_index, scan_key) "
    "SELECT $1::uuid, (position - 1)::integer, " SIXPOINT_SCAN_KEY(
        "scan") " FROM unnest($2::text[]) WITH ORDINALITY AS scans (scan, position)";
constexpr char kSelectSectionScans[] = "SELECT section_measurement_id, " SIXPOINT_SCAN_ID(
    "scan_key") " FROM section_measurement_scans WHERE section_measurement_id = ANY ($1::uuid[]) ORDER BY "
                "section_measurement_id, position_index";
constexpr char kInsertSection[] =
    "INSERT INTO sections (section_measurement_id, position_index, section, origin_in_part_mm, normal_in_part, "
    "reference_in_part, leading_in_part_mm, near_in_part_mm, leading_end, trailing_end, point_count, outlier_count, "
    "noise_um, waver_um, waver_length_mm, gap_share, reason) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, "
    "$12, $13, $14, $15, $16, $17)";
constexpr char kSelectSections[] =
    "SELECT section_measurement_id, section, origin_in_part_mm, normal_in_part, reference_in_part, leading_in_part_mm, "
    "near_in_part_mm, leading_end, trailing_end, point_count, outlier_count, noise_um, waver_um, waver_length_mm, "
    "gap_share, reason FROM sections WHERE section_measurement_id = ANY ($1::uuid[]) ORDER BY section_measurement_id, "
    "position_index";
constexpr char kInsertSectionValues[] =
    "INSERT INTO section_values (section_measurement_id, section_index, position_index, parameter, unit, nominal, "
    "value, expanded_uncertainty, by_noise, by_form, by_pose, reason) SELECT $1::uuid, $2::integer, (position - "
    "1)::integer, parameter, unit, nominal, value, expanded, noise, form, pose, reason FROM unnest($3::text[], "
    "$4::text[], $5::double precision[], $6::double precision[], $7::double precision[], $8::double precision[], "
    "$9::double precision[], $10::double precision[], $11::text[]) WITH ORDINALITY AS one (parameter, unit, nominal, "
    "value, expanded, noise, form, pose, reason, position)";
constexpr char kSelectSectionValues[] =
    "SELECT section_measurement_id, section_index, parameter, unit, nominal, value, expanded_uncertainty, by_noise, "
    "by_form, by_pose, reason FROM section_values WHERE section_measurement_id = ANY ($1::uuid[]) ORDER BY "
    "section_measurement_id, section_index, position_index";
constexpr char kInsertOutline[] =
    "INSERT INTO section_outlines (section_measurement_id, section_index, part_from_section, nominal_mm, measured_mm, "
    "deviations_um, gaps_before) VALUES ($1, $2, $3, $4, $5, $6, $7::double precision[]::integer[])";
constexpr char kSelectOutlines[] =
    "SELECT part_from_section, nominal_mm, measured_mm, deviations_um, gaps_before::double precision[] FROM "
    "section_outlines WHERE section_measurement_id = $1 ORDER BY section_index";

Params SectionMeasurementParams(const SectionMeasurementRow& row) {
  Params params;
  params.Uuid(row.section_measurement_id).Text(row.blade_serial).Uuid(row.registration_id).Text(row.machine_id);
  params.Int(row.machine_revision).Text(row.part_id).Int(row.part_revision).Uuid(row.sensor_calibration_id);
  params.Uuid(row.rotation_calibration_id).Text(row.method).Real(row.half_width_mm).Text(row.reference_section);
  AddOptionalReals(row.neighbour_offset_in_part_mm, &params);
  params.OptionalReal(row.neighbour_standard_uncertainty_um).Digest(row.outlines_sha256);
  return params.Text(row.requested_by).Text(row.software_version).Text(row.computed_on);
}

SectionMeasurementRow ReadSectionMeasurement(const Rows& rows, int row) {
  SectionMeasurementRow measurement;
  measurement.section_measurement_id = rows.Text(row, 0);
  measurement.blade_serial = rows.Text(row, 1);
  measurement.registration_id = rows.Text(row, 2);
  measurement.machine_id = rows.Text(row, 3);
  measurement.machine_revision = static_cast<int>(rows.Int(row, 4));
  measurement.part_id = rows.Text(row, 5);
  measurement.part_revision = static_cast<int>(rows.Int(row, 6));
  measurement.sensor_calibration_id = rows.Text(row, 7);
  measurement.rotation_calibration_id = rows.Text(row, 8);
  measurement.method = rows.Text(row, 9);
  measurement.half_width_mm = rows.Real(row, 10);
  measurement.reference_section = rows.Text(row, 11);
  measurement.neighbour_offset_in_part_mm = OptionalRealsAt(rows, row, 12);
  measurement.neighbour_standard_uncertainty_um = rows.OptionalReal(row, 13);
  measurement.outlines_sha256 = rows.Digest(row, 14);
  measurement.software_version = rows.Text(row, 16);
  measurement.computed_on = rows.Text(row, 17);
  measurement.recorded = {rows.Int(row, 18), rows.Time(row, 19)};
  measurement.requested_by = rows.Text(row, 20);
  measurement.work_order = rows.OptionalText(row, 21);
  measurement.operation = rows.OptionalText(row, 22);
  return measurement;
}

Params SectionParams(const std::string& id, std::size_t index, const SectionRow& row) {
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(index)).Text(row.section).Reals(ListOf(row.origin_in_part_mm));
  params.Reals(ListOf(row.normal_in_part)).Reals(ListOf(row.reference_in_part));
  AddOptionalReals(row.leading_in_part_mm, &params);
  AddOptionalReals(row.near_in_part_mm, &params);
  if (row.found)
    params.Text(row.found->leading_end).Text(row.found->trailing_end).Int(row.point_count).Int(row.outlier_count);
  else
    params.Null().Null().Int(row.point_count).Int(row.outlier_count);
  if (row.found)
    params.Real(row.found->noise_um)
        .Real(row.found->waver_um)
        .Real(row.found->waver_length_mm)
        .Real(row.found->gap_share);
  else
    params.Null().Null().Null().Null();
  return params.Text(row.reason);
}

SectionRow ReadSection(const Rows& rows, int row) {
  SectionRow section;
  section.section = rows.Text(row, 1);
  section.origin_in_part_mm = ThreeOf(rows.Reals(row, 2));
  section.normal_in_part = ThreeOf(rows.Reals(row, 3));
  section.reference_in_part = ThreeOf(rows.Reals(row, 4));
  section.leading_in_part_mm = OptionalRealsAt(rows, row, 5);
  section.near_in_part_mm = OptionalRealsAt(rows, row, 6);
  section.point_count = rows.Int(row, 9);
  section.outlier_count = rows.Int(row, 10);
  section.reason = rows.Text(row, 15);
  if (section.reason.empty())
    section.found = SectionRow::Found{rows.Text(row, 7),  rows.Text(row, 8),  rows.Real(row, 11),
                                      rows.Real(row, 12), rows.Real(row, 13), rows.Real(row, 14)};
  return section;
}

Params SectionValuesParams(const std::string& id, std::size_t index, const std::vector<SectionValueRow>& values) {
  std::vector<std::string> parameters, units, reasons;
  std::vector<std::optional<double>> nominals, found, expanded, by_noise, by_form, by_pose;
  for (const SectionValueRow& value : values) {
    parameters.push_back(value.parameter);
    units.push_back(value.unit);
    nominals.push_back(value.nominal);
    found.push_back(value.value);
    expanded.push_back(value.expanded_uncertainty);
    by_noise.push_back(value.by_noise);
    by_form.push_back(value.by_form);
    by_pose.push_back(value.by_pose);
    reasons.push_back(value.reason);
  }
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(index)).Texts(parameters).Texts(units).OptionalReals(nominals);
  params.OptionalReals(found).OptionalReals(expanded).OptionalReals(by_noise).OptionalReals(by_form);
  return params.OptionalReals(by_pose).Texts(reasons);
}

SectionValueRow ReadSectionValue(const Rows& rows, int row) {
  SectionValueRow value;
  value.parameter = rows.Text(row, 2);
  value.unit = rows.Text(row, 3);
  value.nominal = rows.OptionalReal(row, 4);
  value.value = rows.OptionalReal(row, 5);
  value.expanded_uncertainty = rows.OptionalReal(row, 6);
  value.by_noise = rows.OptionalReal(row, 7);
  value.by_form = rows.OptionalReal(row, 8);
  value.by_pose = rows.OptionalReal(row, 9);
  value.reason = rows.Text(row, 10);
  return value;
}

absl::Status ReadChildren(Transaction& transaction, const ParentRows<SectionMeasurementRow>& parents,
                          bool with_values) {
  const Params ids = Params().Uuids(parents.ids());
  absl::Status read = parents.Add(transaction.Execute(kSelectSectionScans, ids),
                                  [](SectionMeasurementRow& measurement, const Rows& rows, int row) {
                                    measurement.scan_ids.push_back(rows.Text(row, 1));
                                  });
  if (read.ok())
    read = parents.Add(transaction.Execute(kSelectSections, ids),
                       [](SectionMeasurementRow& measurement, const Rows& rows, int row) {
                         measurement.sections.push_back(ReadSection(rows, row));
                       });
  if (!read.ok() || !with_values) return read;
  bool of_sections = true;
  read = parents.Add(transaction.Execute(kSelectSectionValues, ids),
                     [&](SectionMeasurementRow& measurement, const Rows& rows, int row) {
                       const auto index = static_cast<std::size_t>(rows.Int(row, 1));
                       of_sections = of_sections && index < measurement.sections.size();
                       if (of_sections) measurement.sections[index].values.push_back(ReadSectionValue(rows, row));
                     });
  if (read.ok() && !of_sections) return absl::DataLossError("section_values: a row of no section");
  return read;
}

absl::StatusOr<std::vector<SectionMeasurementRow>> ReadSectionMeasurements(Transaction& transaction, const char* sql,
                                                                           const Params& params,
                                                                           bool with_values = true) {
  auto measurements = AllRows(transaction, sql, params, ReadSectionMeasurement);
  if (!measurements.ok() || measurements->empty()) return measurements;
  const ParentRows<SectionMeasurementRow> parents(&*measurements, &SectionMeasurementRow::section_measurement_id);
  if (absl::Status read = ReadChildren(transaction, parents, with_values); !read.ok()) return read;
  return measurements;
}

absl::StatusOr<std::optional<SectionMeasurementRow>> FindSectionMeasurement(Transaction& transaction,
                                                                            const std::string& id) {
  return FirstOf(ReadSectionMeasurements(transaction, kSelectSectionMeasurement, Params().Uuid(id)));
}

absl::StatusOr<std::vector<SectionMeasurementRow>> ListSectionMeasurements(Transaction& transaction,
                                                                           const SectionFilter& filter,
                                                                           std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadSectionMeasurements(transaction, kListSectionMeasurements, params->Int(limit), filter.with_values);
}

absl::StatusOr<std::vector<SectionOutlineRow>> FindOutlines(Transaction& transaction, const std::string& id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectOutlines, Params().Uuid(id));
  if (!rows.ok()) return rows.status();
  std::vector<SectionOutlineRow> outlines;
  for (int row = 0; row < rows->count(); ++row) {
    SectionOutlineRow& outline = outlines.emplace_back();
    outline.part_from_section = rows->Reals(row, 0);
    outline.nominal_mm = rows->Reals(row, 1);
    outline.measured_mm = rows->Reals(row, 2);
    outline.deviations_um = rows->Reals(row, 3);
    for (const double gap : rows->Reals(row, 4)) outline.gaps_before.push_back(static_cast<std::int64_t>(gap));
  }
  return rows->Checked(std::move(outlines));
}

absl::Status InsertSection(Transaction& transaction, const SectionMeasurementRow& measurement, std::size_t i) {
  const std::string& id = measurement.section_measurement_id;
  absl::Status status = transaction.Execute(kInsertSection, SectionParams(id, i, measurement.sections[i])).status();
  if (status.ok())
    status =
        transaction.Execute(kInsertSectionValues, SectionValuesParams(id, i, measurement.sections[i].values)).status();
  if (!status.ok()) return status;
  const SectionOutlineRow& outline = measurement.outlines.at(i);
  const std::vector<double> gaps(outline.gaps_before.begin(), outline.gaps_before.end());
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(i)).Reals(outline.part_from_section).Reals(outline.nominal_mm);
  params.Reals(outline.measured_mm).Reals(outline.deviations_um).Reals(gaps);
  return transaction.Execute(kInsertOutline, params).status();
}

using SectionResults = PostgresResults<SectionMeasurementRow, SectionFilter, SectionStore>;

class PostgresSections final : public SectionResults {
 public:
  using SectionResults::SectionResults;

  absl::StatusOr<std::vector<SectionOutlineRow>> Outlines(const std::string& section_measurement_id,
                                                          Deadline deadline) const override {
    return OneRead(database(), deadline, [&](Transaction& t) { return FindOutlines(t, section_measurement_id); });
  }
};

}  // namespace

absl::StatusOr<Recorded> InsertSectionMeasurement(Transaction& transaction, const SectionMeasurementRow& measurement,
                                                  const RecordEntry& entry) {
  const std::string& id = measurement.section_measurement_id;
  absl::Status status = transaction.Execute(kInsertSectionMeasurement, SectionMeasurementParams(measurement)).status();
  if (status.ok())
    status = transaction.Execute(kInsertSectionScans, Params().Uuid(id).Texts(measurement.scan_ids)).status();
  for (std::size_t i = 0; status.ok() && i < measurement.sections.size(); ++i)
    status = InsertSection(transaction, measurement, i);
  if (!status.ok()) return status;
  return AppendRecord(transaction, id, entry);
}

std::shared_ptr<SectionStore> SectionsIn(Database* database) {
  return std::make_shared<PostgresSections>(
      database, SectionResults::Statements{InsertSectionMeasurement, FindSectionMeasurement, ListSectionMeasurements});
}

}  // namespace sixpoint::storage
