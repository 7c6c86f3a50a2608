// What other instruments measured of blades: a measurement is what one file has of one blade; all of a file are recorded at once.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reader.h"
#include "storage/record.h"
#include "storage/result_store.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

struct MeasuredValueRow {
  std::string characteristic, feature;  // feature: empty: it is at one place
  std::string unit;                     // MM, UM, DEG, RATIO
  std::string zone;                     // RADIUS, HALF_WIDTH, BORDERS; empty: no zone's
  std::optional<double> value, expanded_uncertainty;
  std::string reason;  // empty exactly where there is a value
};

struct InstrumentRow {
  std::string kind;  // CMM, OPTICAL, CT, GAUGE, FLOW_BENCH, OTHER
  std::string manufacturer, model, serial_number;
  std::string certificate;  // empty: none
};

// Of all measurements of a file.
struct MeasuredFileRow {
  std::string drawing_id;
  int drawing_revision = 0;
  std::string part_id;
  InstrumentRow instrument;
  std::string format;  // QIF, AQDEF, CSV
  std::string sha256;  // lower-case hexadecimal
  std::optional<double> lengths_expanded_uncertainty_um, angles_expanded_uncertainty_deg;
  std::string uncertainty_basis;  // empty exactly where neither is stated
  std::string requested_by, software_version;
};

// Of one blade.
struct MeasurementRow {
  std::string measurement_id;
  std::string blade_serial;
  Instant measured_at;
  MeasuredFileRow file;
  std::vector<MeasuredValueRow> values;  // in the drawing's order
  // How many there are, and how many have a value (CountValues): known where they are not read, too.
  int value_count = 0, measured_count = 0;
  std::vector<std::string> left_out;  // names, at most 200
  int left_out_count = 0;
  Recorded recorded;  // set when it is recorded
  // Read only: what its blade was worked on for.
  std::string work_order, operation;
};

void CountValues(MeasurementRow* row);

struct MeasurementImport {
  std::string requested_by;                  // of all
  std::vector<MeasurementRow> measurements;  // of one file
  Recorded recorded;                         // of the first of them
};

// What is empty matches all.
struct MeasurementFilter {
  std::string blade_serial, part_id, drawing_id, instrument_serial_number;
  std::string file_sha256;
  TimeSpan recorded;
  Reader reader;            // what he may not see is not listed
  bool with_values = true;  // reads those too
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<ResultReader<MeasurementRow, MeasurementFilter>> MeasurementsIn(Database* database);
// entry: of the file; blade, name, inputs and summary are each measurement's own.
std::shared_ptr<ResultWriter<MeasurementImport>> MeasurementImportsIn(Database* database);

// The same in a transaction of the caller's: all measurements, then their journal entries, of which the first keeps the request. Call it last
// before the commit.
absl::StatusOr<MeasurementImport> InsertMeasurements(Transaction& transaction, MeasurementImport import,
                                                     const RecordEntry& entry);

}  // namespace sixpoint::storage
