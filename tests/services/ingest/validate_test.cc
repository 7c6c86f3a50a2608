#include "services/ingest/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/services/ingest/sample_scans.h"

namespace sixpoint::ingest {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

// What a refusal says: field, value, wanted.
void ExpectRefused(const absl::Status& status, const std::string& field, const std::string& value) {
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << field << ": " << status;
  EXPECT_THAT(std::string(status.message()), AllOf(StartsWith(field + ": " + value), HasSubstr(", want ")));
}

TEST(CheckHeader, AcceptsASoundHeader) {
  EXPECT_TRUE(CheckHeader(SampleHeader("s1", 100)).ok());
  EXPECT_TRUE(CheckHeader(SampleHeader("s1", 100, v1::ENCODING_XYZ_F64)).ok());
}

TEST(CheckHeader, AcceptsASnapshotInAnyUnit) {
  for (const v1::LengthUnit unit : {v1::LENGTH_UNIT_MILLIMETRE, v1::LENGTH_UNIT_METRE, v1::LENGTH_UNIT_INCH})
    EXPECT_TRUE(CheckHeader(SampleSnapshot("s1", unit)).ok());
  EXPECT_TRUE(CheckHeader(SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE, v1::ENCODING_DRACO)).ok());
  EXPECT_EQ(MmPerUnit(SampleSnapshot("s1", v1::LENGTH_UNIT_METRE)), 1000);
  EXPECT_EQ(MmPerUnit(SampleSnapshot("s1", v1::LENGTH_UNIT_INCH)), 25.4);
  EXPECT_EQ(MmPerUnit(SampleHeader("s1", 1)), 1);
}

TEST(CheckHeader, SaysWhatASnapshotMustNotHave) {
  const auto refused = [](const std::string& field, const std::string& value, auto spoil) {
    v1::ScanHeader header = SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE);
    spoil(&header);
    ExpectRefused(CheckHeader(header), field, value);
  };
  using Header = v1::ScanHeader;
  refused("header.length_unit", "not given", [](Header* h) { h->clear_length_unit(); });
  refused("header.length_unit", "9", [](Header* h) { h->set_length_unit(static_cast<v1::LengthUnit>(9)); });
  refused("header.cloud", "9", [](Header* h) { h->set_cloud(static_cast<v1::CloudKind>(9)); });
  refused("header.profile_pitch_mm", "0.05", [](Header* h) { h->set_profile_pitch_mm(0.05); });
  refused("header.profile_pitch_mm", "NaN", [](Header* h) { h->set_profile_pitch_mm(kNan); });
  refused("header.columns_per_profile", "1", [](Header* h) { h->set_columns_per_profile(1); });
  refused("header.travel", "SCAN_TRAVEL_FORWARD", [](Header* h) { h->set_travel(v1::SCAN_TRAVEL_FORWARD); });
  refused("header.encoding", "RAW_PROFILES", [](Header* h) {
    h->set_encoding(v1::ENCODING_RAW_PROFILES);
    h->set_raw_step_um(1);
  });
  refused("header.length_unit", "METRE", [](Header* h) {
    h->set_encoding(v1::ENCODING_DRACO);
    h->set_length_unit(v1::LENGTH_UNIT_METRE);
  });
  // A line scanner's are in mm.
  Header profiles = SampleHeader("s1", 1);
  profiles.set_length_unit(v1::LENGTH_UNIT_INCH);
  ExpectRefused(CheckHeader(profiles), "header.length_unit", "INCH");
  profiles.set_length_unit(v1::LENGTH_UNIT_MILLIMETRE);
  profiles.set_cloud(v1::CLOUD_KIND_PROFILES);
  EXPECT_TRUE(CheckHeader(profiles).ok());
}

TEST(CheckAgainstMachine, WantsTheCloudThatItsSensorGives) {
  const v1::ScanHeader profiles = SampleHeader("s1", 1), snapshot = SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE);
  EXPECT_TRUE(CheckAgainstMachine(snapshot, SampleSnapshotMachine()).ok());
  ExpectRefused(CheckAgainstMachine(profiles, SampleSnapshotMachine()), "header.cloud", "PROFILES, want SNAPSHOT");
  ExpectRefused(CheckAgainstMachine(snapshot, SampleMachine()), "header.cloud", "SNAPSHOT, want PROFILES");
}

// x is no encoder's reading: the view's cone bounds it as it bounds y.
TEST(CheckStatistics, HoldsASnapshotToItsView) {
  const v1::ScanHeader header = SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE);
  const plant::v1::Sensor sensor = SampleSnapshotMachine().sensor();  // (66 + 25) tan 15 deg = 24.38 mm
  const auto check = [&](const metrology::Points& points_mm) {
    return CheckStatistics(header, sensor, 2, StatisticsOf(points_mm, 0, {}));
  };
  EXPECT_TRUE(check({{24, -24, 24}, {-24, 24, -24}, {3, 0, 0}}).ok());
  ExpectRefused(check({{25, 0, 0}}), "block[2].payload.x_mm", "25");
  ExpectRefused(check({{0, -25, 0}}), "block[2].payload.y_mm", "-25");
  ExpectRefused(check({{0, 0, 26}}), "block[2].payload.z_mm", "26");
}

TEST(CheckHeader, NamesTheFieldThatIsWrong) {
  struct Case {
    std::string field, value;
    std::function<void(v1::ScanHeader*)> spoil;
  };
  const std::vector<Case> cases = {
      {"header.scan_id", "empty", [](auto* h) { h->set_scan_id(""); }},
      {"header.arm_series", "s 1", [](auto* h) { h->set_arm_series("s 1"); }},
      {"header.clamping", "c/1", [](auto* h) { h->set_clamping("c/1"); }},
      {"header.station", "s/1", [](auto* h) { h->set_station("s/1"); }},
      {"header.station", "s1",
       [](auto* h) {
         h->set_station("s1");
         h->set_kind(v1::SCAN_KIND_ARTEFACT);
         h->set_subject("artefacts/a1");
       }},
      {"header.subject_temperature_c", "61", [](auto* h) { h->set_subject_temperature_c(61); }},
      {"header.scales_temperature_c", "NaN", [](auto* h) { h->set_scales_temperature_c(kNan); }},
      {"header.subject_temperature_c", "not given", [](auto* h) { h->clear_subject_temperature_c(); }},
      {"header.travel", "7", [](auto* h) { h->set_travel(static_cast<v1::ScanTravel>(7)); }},
      {"header.scan_id", "a/b", [](auto* h) { h->set_scan_id("a/b"); }},
      {"header.scan_id", "xxx", [](auto* h) { h->set_scan_id(std::string(65, 'x')); }},
      {"header.machine", "empty", [](auto* h) { h->set_machine(""); }},
      {"header.machine", "m1", [](auto* h) { h->set_machine("m1"); }},
      {"header.subject", "empty", [](auto* h) { h->set_subject(""); }},
      {"header.subject", "artefacts/a1", [](auto* h) { h->set_subject("artefacts/a1"); }},  // but AIRFOIL
      {"header.subject", "blades/sn1", [](auto* h) { h->set_kind(v1::SCAN_KIND_ARM); }},
      {"header.kind", "0", [](auto* h) { h->clear_kind(); }},
      {"header.kind", "99", [](auto* h) { h->set_kind(static_cast<v1::ScanKind>(99)); }},
      {"header.v0_mm", "missing", [](auto* h) { h->clear_v0_mm(); }},
      {"header.v0_mm.x_mm", "NaN", [](auto* h) { h->mutable_v0_mm()->set_x_mm(kNan); }},
      {"header.v0_mm.z_mm", "-inf", [](auto* h) { h->mutable_v0_mm()->set_z_mm(-kInfinity); }},
      {"header.a_deg", "NaN", [](auto* h) { h->set_a_deg(kNan); }},
      {"header.b_deg", "inf", [](auto* h) { h->set_b_deg(kInfinity); }},
      {"header.profile_pitch_mm", "0", [](auto* h) { h->set_profile_pitch_mm(0); }},
      {"header.profile_pitch_mm", "-0.025", [](auto* h) { h->set_profile_pitch_mm(-0.025); }},
      {"header.profile_pitch_mm", "NaN", [](auto* h) { h->set_profile_pitch_mm(kNan); }},
      {"header.columns_per_profile", "0", [](auto* h) { h->set_columns_per_profile(0); }},
      {"header.columns_per_profile", "-1", [](auto* h) { h->set_columns_per_profile(-1); }},
      {"header.point_count", "-7", [](auto* h) { h->set_point_count(-7); }},
      {"header.point_count", "9000000000", [](auto* h) { h->set_point_count(9'000'000'000); }},
      {"header.encoding", "0", [](auto* h) { h->clear_encoding(); }},
      {"header.encoding", "7", [](auto* h) { h->set_encoding(static_cast<v1::Encoding>(7)); }},
      {"header.sender_error_um", "-1", [](auto* h) { h->set_sender_error_um(-1); }},
      {"header.sender_error_um", "NaN", [](auto* h) { h->set_sender_error_um(kNan); }},
      {"header.error_bound_um", "-0.5", [](auto* h) { h->set_error_bound_um(-0.5); }},
      {"header.measured_at.nanos", "-1", [](auto* h) { h->mutable_measured_at()->set_nanos(-1); }},
      {"header.measured_at.seconds", "9223372036854775807",
       [](auto* h) { h->mutable_measured_at()->set_seconds(std::numeric_limits<std::int64_t>::max()); }},
  };
  for (const Case& c : cases) {
    v1::ScanHeader header = SampleHeader("s1", 100);
    c.spoil(&header);
    ExpectRefused(CheckHeader(header), c.field, c.value);
  }
}

TEST(CheckAgainstMachine, KeepsToTheMachinesAxesAndColumns) {
  const plant::v1::Machine machine = SampleMachine();
  v1::ScanHeader header = SampleHeader("s1", 100);
  EXPECT_TRUE(CheckAgainstMachine(header, machine).ok());
  header.set_a_deg(100.5);
  ExpectRefused(CheckAgainstMachine(header, machine), "header.a_deg", "100.5");
  header.set_a_deg(100);
  EXPECT_TRUE(CheckAgainstMachine(header, machine).ok());
  header.set_b_deg(-361);
  ExpectRefused(CheckAgainstMachine(header, machine), "header.b_deg", "-361");
  header.set_b_deg(0);
  header.set_columns_per_profile(1281);
  ExpectRefused(CheckAgainstMachine(header, machine), "header.columns_per_profile", "1281");
  header.set_columns_per_profile(1280);
  header.set_sensor_serial_number("another");
  ExpectRefused(CheckAgainstMachine(header, machine), "header.sensor_serial_number", "another");
  header.clear_sensor_serial_number();
  EXPECT_TRUE(CheckAgainstMachine(header, machine).ok());
}

TEST(CheckAgainstMachine, RefusesACommandForAnAxisThatIsNotThere) {
  plant::v1::Machine machine = SampleMachine();
  machine.mutable_kinematics()->mutable_part_side()->RemoveLast();
  v1::ScanHeader header = SampleHeader("s1", 100);
  ExpectRefused(CheckAgainstMachine(header, machine), "header.b_deg", "180");
  header.set_b_deg(0);
  EXPECT_TRUE(CheckAgainstMachine(header, machine).ok());
}

TEST(CheckBlock, AcceptsBlocksInOrder) {
  const auto points_mm = SampleProfiles(4, 50);
  for (const v1::Encoding encoding : {v1::ENCODING_DRACO, v1::ENCODING_XYZ_F64}) {
    const auto blocks = SampleBlocks(points_mm, 100, encoding);
    const v1::ScanHeader header = SampleHeader("s1", 200, encoding);
    EXPECT_TRUE(CheckBlock(header, {0, 0}, blocks[0]).ok());
    EXPECT_TRUE(CheckBlock(header, {1, 100}, blocks[1]).ok());
  }
}

// Each block is a row for ever.
TEST(CheckBlock, RefusesBlocksThatAreTooSmallOnTheMean) {
  v1::ScanHeader header = SampleHeader("s1", 0);
  v1::ScanBlock block = SampleBlocks(SampleProfiles(4, 50), 100)[0];
  const auto at = [&](int index, std::int64_t points) {
    block.set_index(index);
    return CheckBlock(header, {index, points}, block);
  };
  EXPECT_TRUE(at(999, 999).ok());
  ExpectRefused(at(1000, 1000 - 1), "block[1000].index", "1000 after 999 points");
  EXPECT_TRUE(at(1000, 1000).ok());
  ExpectRefused(at(20'000, 19'000'000), "block[20000].index", "20000 after 19000000 points");
  // The smallest blocks of a scanner: ten profiles of a thousand points.
  EXPECT_TRUE(at(9'999, 99'990'000).ok());
}

TEST(CheckBlock, RefusesWrongOrderCountsAndSizes) {
  const auto points_mm = SampleProfiles(4, 50);
  const v1::ScanHeader header = SampleHeader("s1", 200);
  const auto blocks = SampleBlocks(points_mm, 100);
  ExpectRefused(CheckBlock(header, {0, 0}, blocks[1]), "block[0].index", "1");
  ExpectRefused(CheckBlock(header, {2, 200}, blocks[1]), "block[2].index", "1");
  ExpectRefused(CheckBlock(header, {1, 101}, blocks[1]), "block[1].point_count", "100");
  v1::ScanBlock block = blocks[0];
  block.set_index(kMostBlocks);
  ExpectRefused(CheckBlock(header, {kMostBlocks, 99'000'000}, block), "block[65536].index", "65536");
  block = blocks[0];
  block.set_point_count(0);
  ExpectRefused(CheckBlock(header, {0, 0}, block), "block[0].point_count", "0");
  block.set_point_count(-3);
  ExpectRefused(CheckBlock(header, {0, 0}, block), "block[0].point_count", "-3");
  block.set_point_count(1'000'000);
  ExpectRefused(CheckBlock(SampleHeader("s1", 2'000'000), {0, 0}, block), "block[0].point_count", "1000000");
  block.set_point_count(99);  // the Draco header says 100
  ExpectRefused(CheckBlock(header, {0, 0}, block), "block[0].payload", "100 points in the Draco header");
  block = blocks[0];
  block.mutable_payload()->append(100'000, 'x');
  ExpectRefused(CheckBlock(header, {0, 0}, block), "block[0].payload", std::to_string(block.payload().size()));
  block.clear_payload();
  ExpectRefused(CheckBlock(header, {0, 0}, block), "block[0].payload", "0 bytes");
  v1::ScanHeader raw_header = header;
  raw_header.set_encoding(v1::ENCODING_XYZ_F64);
  block = SampleBlocks(points_mm, 100, v1::ENCODING_XYZ_F64)[0];
  block.mutable_payload()->pop_back();
  ExpectRefused(CheckBlock(raw_header, {0, 0}, block), "block[0].payload", "2399 bytes");
}

TEST(CheckBlock, RefusesABombByItsHeader) {
  v1::ScanBlock block;
  block.set_point_count(100'000);
  block.set_payload(DracoHeaderOf(10'000'000) + std::string(43, '\x01'));
  ASSERT_EQ(block.payload().size(), 58U);
  ExpectRefused(CheckBlock(SampleHeader("s1", 10'000'000), {0, 0}, block), "block[0].payload",
                "the Draco header declares 10000000 points");
}

TEST(CheckStatistics, KeepsToTheSensorsRange) {
  const plant::v1::Sensor sensor = SampleMachine().sensor();
  const v1::ScanHeader header = SampleHeader("s1", 3);
  const auto check = [&](const metrology::Points& points_mm) {
    return CheckStatistics(header, sensor, 4, StatisticsOf(points_mm, header.profile_pitch_mm(), {}));
  };
  EXPECT_TRUE(check({{0, 0, 12.5}, {0, 1, -12.5}}).ok());
  EXPECT_TRUE(check({{0, 0, 12.51}}).ok());  // noise
  ExpectRefused(check({{0, 0, 12.6}}), "block[4].payload.z_mm", "12.6");
  ExpectRefused(check({{0, 0, -13}}), "block[4].payload.z_mm", "-13");
  // The line's half length at the end of the range: (66 + 12.5) tan(10 deg) = 13.84 mm.
  EXPECT_TRUE(check({{0, 13.8, 0}}).ok());
  ExpectRefused(check({{0, -13.9, 0}}), "block[4].payload.y_mm", "-13.9");
  ExpectRefused(check({{20000, 0, 0}}), "block[4].payload.x_mm", "20000");
  ExpectRefused(check({{0, 0, kNan}}), "block[4].payload", "1 points with NaN");
  ExpectRefused(check({{1, 0, 0}, {0.5, 0, 0}}), "block[4].payload.x_mm", "-0.5");
}

TEST(CheckStatistics, RefusesMoreColumnsThanTheSensorHas) {
  v1::ScanHeader header = SampleHeader("s1", 3);
  header.set_columns_per_profile(2);
  const BlockStatistics statistics = StatisticsOf({{0, 0, 0}, {0, 1, 0}, {0, 2, 0}}, 0.05, {});
  ExpectRefused(CheckStatistics(header, SampleMachine().sensor(), 0, statistics), "block[0].payload",
                "3 points in one profile");
}

TEST(CheckEnd, RefusesWhatDoesNotAgreeWithWhatCame) {
  v1::ScanHeader header = SampleHeader("s1", 200);
  const std::string sha256(64, 'a');
  v1::ScanEnd end;
  end.set_block_count(2);
  end.set_point_count(200);
  end.set_sha256(sha256);
  EXPECT_TRUE(CheckEnd(header, end, {2, 200}, sha256).ok());
  ExpectRefused(CheckEnd(header, end, {2, 200}, std::string(64, 'b')), "end.sha256", sha256);
  ExpectRefused(CheckEnd(header, end, {1, 200}, sha256), "end.block_count", "2");
  ExpectRefused(CheckEnd(header, end, {2, 100}, sha256), "end.point_count", "200");
  ExpectRefused(CheckEnd(header, end, {0, 0}, sha256), "end.block_count", "0");
  end.set_point_count(100);
  ExpectRefused(CheckEnd(header, end, {2, 100}, sha256), "header.point_count", "200");
  header.set_point_count(0);  // never told
  EXPECT_TRUE(CheckEnd(header, end, {2, 100}, sha256).ok());
}

TEST(CheckAgainstTolerance, SpendsATenthAtMost) {
  v1::ScanHeader header = SampleHeader("s1", 200, v1::ENCODING_XYZ_F64);
  EXPECT_TRUE(CheckAgainstTolerance(header, 0.03).ok());
  EXPECT_TRUE(CheckAgainstTolerance(header, 0.0026).ok());  // the default bound, 0.25 um
  ExpectRefused(CheckAgainstTolerance(header, 0.0024), "header.error_bound_um", "0.25");
  header.set_sender_error_um(2.8);
  ExpectRefused(CheckAgainstTolerance(header, 0.03), "header.sender_error_um", "3.05");
  header.set_encoding(v1::ENCODING_DRACO);  // kept as sent
  EXPECT_TRUE(CheckAgainstTolerance(header, 0.03).ok());
}

}  // namespace
}  // namespace sixpoint::ingest
