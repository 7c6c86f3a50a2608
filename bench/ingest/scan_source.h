// Scans to send: profiles as a sensor gives them, in whole steps, sensor frame.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "metrology/cloud/range_image.h"
#include "metrology/frames/pose.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::bench {

// A scanCONTROL 2960-25.
inline constexpr int kColumnCount = 1280;
inline constexpr double kMidRangeMm = 66;
inline constexpr double kRangeMm = 25;
inline constexpr double kLineAngleDeg = 20;
inline constexpr double kNoiseUm = 2;
inline constexpr double kRawStepUm = 0.5;
metrology::ScannerFan SensorFan();

struct RawProfile {
  double x_mm = 0;
  std::vector<int> columns;
  std::vector<std::int32_t> y_steps, z_steps;
};
struct RawScan {
  std::string name;
  double pitch_mm = 0.05;
  std::vector<RawProfile> profiles;
};

// A curved surface with an edge, every column measured, 2 um of noise. The same seed gives the same scan.
RawScan BladeLikeScan(int profile_count, int column_count, std::uint64_t seed);
// One of plant-a's Draco files, in whole steps on the sensor's columns.
absl::StatusOr<RawScan> ReadScanFile(const std::string& path);

// Profiles [first, first + count) in each form that ingest takes.
std::int64_t PointCount(const RawScan& scan, std::size_t first, std::size_t count);
metrology::Points PointsOf(const RawScan& scan, std::size_t first, std::size_t count);
std::vector<int> ColumnsOf(const RawScan& scan, std::size_t first, std::size_t count);
std::string RawPayload(const RawScan& scan, std::size_t first, std::size_t count);
std::string XyzPayload(const metrology::Points& points_mm);

// Of blades/bench on machines/bench-{machine}.
ingest::v1::ScanHeader HeaderFor(const std::string& scan_id, int machine, ingest::v1::Encoding encoding);

// SHA-256 as bytes (32), and what ScanEnd.sha256 says of the blocks' digests.
std::string Sha256(std::string_view bytes);
std::string HexOf(std::string_view digest);
ingest::v1::ScanEnd EndOf(const std::vector<std::string>& digests, std::int64_t point_count);

}  // namespace sixpoint::bench
