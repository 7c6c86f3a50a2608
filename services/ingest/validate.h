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
// Each is a row for ever. Scanners send 10 to 100 profiles of about 1000 points in one, and never less than a thousand on the mean of
// many: a scan of one-point blocks ends at its thousandth.
inline constexpr int kMostBlocks = 65'536;
inline constexpr int kMostSmallBlocks = 1000;
inline constexpr std::int64_t kLeastMeanPointCount = 1000;  // of the blocks after those
// A float32 cloud that nothing compressed takes 12 bytes a point.
inline constexpr std::int64_t kGreatestBytesPerPoint = 16;
inline constexpr std::int64_t kBlockOverheadBytes = 4096;

// What the header says by itself: form of ids and names, finite numbers, counts, known enums, kind fits subject.
absl::Status CheckHeader(const v1::ScanHeader& header);

// What this machine's record adds: axis limits, what its sensor gives, sensor columns.
absl::Status CheckAgainstMachine(const v1::ScanHeader& header, const plant::v1::Machine& machine);

// Sender's and store's errors together: at most a tenth of the tightest tolerance, as of any instrument that judges it.
absl::Status CheckAgainstTolerance(const v1::ScanHeader& header, double tightest_tolerance_mm);

// How far an upload has come.
struct UploadSoFar {
  int block_count = 0;
  std::int64_t point_count = 0;
};
// Order, counts and sizes of the next block, and the Draco header of its payload; decodes nothing.
absl::Status CheckBlock(const v1::ScanHeader& header, const UploadSoFar& so_far, const v1::ScanBlock& block);

// The points of a block against the sensor: finite, inside its range (with a margin for noise); of profiles also no more columns to one
// than it has, x not running backwards.
absl::Status CheckStatistics(const v1::ScanHeader& header, const plant::v1::Sensor& sensor, int block_index,
                             const BlockStatistics& statistics);

// What the sender says it sent, against what came and, where the header told, what it announced. `sha256`: of what came.
absl::Status CheckEnd(const v1::ScanHeader& header, const v1::ScanEnd& end, const UploadSoFar& so_far,
                      const std::string& sha256);

// The error that storing may add, mm.
double ErrorBoundMm(const v1::ScanHeader& header);

bool IsSnapshot(const v1::ScanHeader& header);
// What one unit of its coordinates, as they are sent, is.
double MmPerUnit(const v1::ScanHeader& header);

}  // namespace sixpoint::ingest
