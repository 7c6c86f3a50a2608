// What lists of registrations, corrections and inspections have in common to ask for.
#pragma once

#include <cstdint>
#include <string>

#include "storage/clearances.h"
#include "storage/reader.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

// What is empty matches all.
struct ResultFilter {
  std::string blade_serial;
  std::string machine_id;
  std::string part_id;
  std::string calibration_id;  // the sensor's, the axes', or one of an axis whose table was applied
  TimeSpan recorded;
  Reader reader;  // what he may not see is not listed
};

// Of the rows of that table, which have both calibrations: those that rest on the one of that parameter (NULL: all).
#define SIXPOINT_RESTS_ON(parameter, table)                                         \
  "(" parameter "::uuid IS NULL OR " parameter                                      \
  "::uuid IN (sensor_calibration_id, rotation_calibration_id) "                     \
  "OR EXISTS (SELECT 1 FROM registration_angles a WHERE a.registration_id = " table \
  ".registration_id AND a.characterisation_id = " parameter "::uuid)) "

// The rows of a page of that table, each with its entry of the journal; $1 to $9 as FilterParams has them.
#define SIXPOINT_RESULT_FILTER(table, kind) \
  "entry_kind = '" kind                                                                                   \
  "' AND ($1::bigint = 0 OR record_sequence < $1::bigint) "                                               \
  "AND ($2 = '' OR entry_blade = $2) AND ($3 = '' OR entry_machine = $3) AND ($4 = '' OR part_id = $4) "  \
  "AND " SIXPOINT_RESTS_ON("$5", table)                                                                   \
  "AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) " \
  "AND part_id <> ALL ($8::text[]) AND ($9::text[] IS NULL OR entry_blade = ANY ($9::text[])) "

// Where blades are named ($9) their rows are found and then sorted: by the index of the order PostgreSQL would walk through everybody's
// until it met enough of them.
#define SIXPOINT_NEWEST_FIRST \
  "ORDER BY (CASE WHEN $9::text[] IS NULL THEN record_sequence ELSE record_sequence + 0 END) DESC "

inline absl::StatusOr<Params> FilterParams(Transaction& transaction, std::int64_t before_sequence,
                                           const ResultFilter& filter) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, filter.reader);
  if (!sight.ok()) return sight.status();
  Params params;
  params.Int(before_sequence).Text(filter.blade_serial).Text(filter.machine_id).Text(filter.part_id);
  params.OptionalUuid(filter.calibration_id);
  AddSpan(filter.recorded, &params);
  AddSight(*sight, &params);
  return params;
}

}  // namespace sixpoint::storage
