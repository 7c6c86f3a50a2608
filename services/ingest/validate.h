// What a scan must be before ingest stores it. Pure functions; each refusal is INVALID_ARGUMENT and names the field, its
// value and what was wanted (runtime::Refuse).
#pragma once

#include <absl/status/status.h>

#include <string>

#include "services/ingest/block_statistics.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::ingest {

// About 400 MB stored, and more than a metre of a fine scan.
inline constexpr std::int64_t kGreatestScanPointCount = 100'000'000;
// Three mebibytes of doubles: fits a message with room.
inline constexpr int kGreatestBlockPointCount = 131'072;
// A float32 cloud that nothing compressed takes 12 bytes a point.
inline constexpr std::int64_t kGreatestBytesPerPoint = 16;
inline constexpr std::int64_t kBlockOverheadBytes = 4096;

// What the header says by itself: form of ids and names, finite numbers, counts, known enums, kind fits subject.
absl::Status CheckHeader(const v1::ScanHeader& header);

// What this machine's record adds: axis limits, sensor columns.
absl::Status CheckAgainstMachine(const v1::ScanHeader& header, const plant::v1::Machine& machine);

// How far an upload has come.
struct UploadProgress {
  int block_count = 0;
  std::int64_t point_count = 0;
};
// Order, counts and sizes of the next block, and the Draco header of its payload; decodes nothing.
absl::Status CheckBlock(const v1::ScanHeader& header, const UploadProgress& progress, const v1::ScanBlock& block);

// The points of a block against the sensor: finite, inside its range (with a margin for noise), no more columns to a
// profile than it has, x not running backwards.
absl::Status CheckStatistics(const v1::ScanHeader& header, const plant::v1::Sensor& sensor, int block_index,
                             const BlockStatistics& statistics);

// At the end of the stream: as many points as the header says.
absl::Status CheckComplete(const v1::ScanHeader& header, const UploadProgress& progress);

// The error that storing may add, mm.
double ErrorBoundMm(const v1::ScanHeader& header);

}  // namespace sixpoint::ingest
