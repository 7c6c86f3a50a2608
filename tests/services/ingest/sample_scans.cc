#include "tests/services/ingest/sample_scans.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "metrology/cloud/draco_codec.h"

namespace sixpoint::ingest {

metrology::Points SampleProfiles(int profile_count, int column_count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise_mm(0.0, 0.002);
  metrology::Points points_mm;
  for (int i = 0; i < profile_count; ++i) {
    for (int j = 0; j < column_count; ++j) {
      const double y = -10.0 + 20.0 * j / column_count;
      points_mm.emplace_back(0.05 * i, y, 5.0 * std::sin(0.2 * y + 0.01 * i) + noise_mm(random));
    }
  }
  return points_mm;
}

plant::v1::Machine SampleMachine() {
  plant::v1::Machine machine;
  machine.set_name("machines/m1");
  machine.set_revision(3);
  for (const char* axis : {"A", "B"}) {
    plant::v1::Joint& joint = *machine.mutable_kinematics()->add_part_side();
    joint.set_axis(axis);
    joint.set_kind(plant::v1::JOINT_KIND_ROTARY);
    joint.set_sign(1);
    joint.set_minimum(*axis == 'A' ? -100 : -360);
    joint.set_maximum(*axis == 'A' ? 100 : 360);
  }
  machine.mutable_sensor()->set_model("scanCONTROL 2960-25");
  machine.mutable_sensor()->set_noise_um(2);
  machine.mutable_sensor()->set_column_count(1280);
  machine.mutable_sensor()->set_mid_range_mm(66);
  machine.mutable_sensor()->set_range_mm(25);
  machine.mutable_sensor()->set_line_angle_deg(20);
  machine.mutable_sensor()->set_serial_number("2960-25-0815");
  return machine;
}

plant::v1::Machine SampleSnapshotMachine() {
  plant::v1::Machine machine = SampleMachine();
  machine.mutable_sensor()->set_kind(plant::v1::SENSOR_KIND_SNAPSHOT);
  machine.mutable_sensor()->set_column_count(0);
  machine.mutable_sensor()->set_range_mm(50);
  machine.mutable_sensor()->set_line_angle_deg(30);
  return machine;
}

v1::ScanHeader SampleSnapshot(const std::string& scan_id, v1::LengthUnit unit, v1::Encoding encoding) {
  v1::ScanHeader header = SampleHeader(scan_id, 0, encoding);
  header.set_cloud(v1::CLOUD_KIND_SNAPSHOT);
  header.set_length_unit(unit);
  header.clear_profile_pitch_mm();
  header.clear_columns_per_profile();
  header.clear_travel();
  return header;
}

v1::ScanHeader SampleHeader(const std::string& scan_id, std::int64_t point_count, v1::Encoding encoding) {
  v1::ScanHeader header;
  header.set_scan_id(scan_id);
  header.set_machine("machines/m1");
  header.set_subject("blades/sn1");
  header.set_kind(v1::SCAN_KIND_AIRFOIL);
  header.set_arm_series("s1");
  header.set_clamping("c1");
  header.set_subject_temperature_c(21.5);
  header.set_scales_temperature_c(22.25);
  header.set_sensor_serial_number("2960-25-0815");
  header.set_travel(v1::SCAN_TRAVEL_BACKWARD);
  header.mutable_v0_mm()->set_x_mm(-190.0088);
  header.mutable_v0_mm()->set_y_mm(-178.8434);
  header.mutable_v0_mm()->set_z_mm(275.2997);
  header.set_a_deg(-50);
  header.set_b_deg(180);
  header.set_profile_pitch_mm(0.05);
  header.set_columns_per_profile(1280);
  header.set_point_count(point_count);
  header.set_encoding(encoding);
  header.mutable_measured_at()->set_seconds(1'780'000'000);
  header.mutable_measured_at()->set_nanos(123'456'789);
  return header;
}

std::vector<v1::ScanBlock> SampleBlocks(const metrology::Points& points_mm, std::size_t block_point_count,
                                        v1::Encoding encoding) {
  std::vector<v1::ScanBlock> blocks;
  for (std::size_t begin = 0; begin < points_mm.size(); begin += block_point_count) {
    const std::size_t end = std::min(points_mm.size(), begin + block_point_count);
    const metrology::Points part(points_mm.begin() + static_cast<std::ptrdiff_t>(begin),
                                 points_mm.begin() + static_cast<std::ptrdiff_t>(end));
    v1::ScanBlock& block = blocks.emplace_back();
    block.set_index(static_cast<int>(blocks.size()) - 1);
    block.set_point_count(static_cast<int>(part.size()));
    if (encoding == v1::ENCODING_DRACO) {
      block.set_payload(metrology::EncodeBlock(part, metrology::kDefaultErrorBoundMm).value().bytes);
    } else {
      std::string bytes(part.size() * 24, '\0');
      std::memcpy(bytes.data(), part.data(), bytes.size());
      block.set_payload(bytes);
    }
  }
  return blocks;
}

std::string DracoHeaderOf(std::int32_t point_count) {
  std::string bytes("DRACO\x02\x03\x00\x00\x00\x00", 11);
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(static_cast<std::uint32_t>(point_count) >> (8 * i));
  return bytes;
}

}  // namespace sixpoint::ingest
