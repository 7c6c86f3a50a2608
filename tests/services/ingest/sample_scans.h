// Scans, headers and a machine that the ingest tests share.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::ingest {

// Profiles along x, 0.05 mm apart, columns along y, a wavy depth with 2 um of noise: inside the sensor's range.
metrology::Points SampleProfiles(int profile_count, int column_count, unsigned seed = 1);

// machines/m1, revision 3: a SARIX SX200 Aero with a scanCONTROL 2960-25.
plant::v1::Machine SampleMachine();

// The same machine with a snapshot sensor of a wider view: 50 mm deep, 30 degrees.
plant::v1::Machine SampleSnapshotMachine();
// A snapshot of blades/sn1 on it, in that unit.
v1::ScanHeader SampleSnapshot(const std::string& scan_id, v1::LengthUnit unit,
                              v1::Encoding encoding = v1::ENCODING_XYZ_F64);

// A scan of blades/sn1 on machines/m1 with that many points.
v1::ScanHeader SampleHeader(const std::string& scan_id, std::int64_t point_count,
                            v1::Encoding encoding = v1::ENCODING_DRACO);

// Cut every `block_point_count` points.
std::vector<v1::ScanBlock> SampleBlocks(const metrology::Points& points_mm, std::size_t block_point_count,
                                        v1::Encoding encoding = v1::ENCODING_DRACO);

// A well-formed Draco header for that many points.
std::string DracoHeaderOf(std::int32_t point_count);

}  // namespace sixpoint::ingest
