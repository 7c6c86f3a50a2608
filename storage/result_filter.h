// What lists of registrations, corrections and inspections have in common to ask for.
#pragma once

#include <cstdint>
#include <string>

#include "storage/time_span.h"

namespace sixpoint::storage {

// What is empty matches all.
struct ResultFilter {
  std::string blade_serial;
  std::string machine_id;
  std::string part_id;
  std::string calibration_id;  // the sensor's, the axes', or one of an axis whose table was applied
  TimeSpan recorded;
};

// The rows of a page of that table, each with its entry of the journal; $1 to $7 as FilterParams has them.
#define SIXPOINT_RESULT_FILTER(table, kind)                                                              \
  "entry_kind = '" kind                                                                                  \
  "' AND ($1::bigint = 0 OR record_sequence < $1::bigint) "                                              \
  "AND ($2 = '' OR entry_blade = $2) AND ($3 = '' OR entry_machine = $3) AND ($4 = '' OR part_id = $4) " \
  "AND ($5::uuid IS NULL OR $5::uuid IN (sensor_calibration_id, rotation_calibration_id) OR EXISTS "     \
  "(SELECT 1 FROM registration_angles a WHERE a.registration_id = " table                                \
  ".registration_id AND a.characterisation_id = $5::uuid)) "                                             \
  "AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) "

inline Params FilterParams(std::int64_t before_sequence, const ResultFilter& filter) {
  Params params;
  params.Int(before_sequence).Text(filter.blade_serial).Text(filter.machine_id).Text(filter.part_id);
  params.OptionalUuid(filter.calibration_id);
  AddSpan(filter.recorded, &params);
  return params;
}

}  // namespace sixpoint::storage
