#include "services/ingest/validate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "metrology/cloud/draco_codec.h"
#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/units.h"

namespace sixpoint::ingest {
namespace {

using runtime::Refuse;

// No machine tool is larger, and float32 is fine enough for every encoder reading below it.
constexpr double kGreatestCoordinateMm = 1e5;
constexpr double kGreatestEncoderMm = 1e4;
constexpr double kGreatestAngleDeg = 36'000.0;
constexpr double kGreatestPitchMm = 100.0;
constexpr double kGreatestErrorUm = 1000.0;
constexpr std::int64_t kLatestClock_s = 7'258'118'399;  // the end of 2199
constexpr double kGreatestRawStepUm = 100.0;
// The rule of ten: what measures may spend a tenth of the tolerance that it judges.
constexpr double kToleranceShare = 0.1;
// A reading just outside of the range by noise is still a reading.
constexpr double kNoiseMargins = 10.0;
constexpr double kLeastMarginMm = 0.02;

absl::Status CheckNumber(const std::string& field, double value, double least, double greatest) {
  if (std::isfinite(value) && value >= least && value <= greatest) return absl::OkStatus();
  return Refuse(field, value, "a number from " + NumberText(least) + " to " + NumberText(greatest));
}

absl::Status CheckSubject(const v1::ScanHeader& header) {
  std::string collection;
  switch (header.kind()) {
    case v1::SCAN_KIND_ARTEFACT:
    case v1::SCAN_KIND_ARM:
      collection = "artefacts";
      break;
    case v1::SCAN_KIND_AIRFOIL:
    case v1::SCAN_KIND_LOCAL:
    case v1::SCAN_KIND_PINS:
      collection = "blades";
      break;
    default:
      return Refuse("header.kind", std::to_string(header.kind()), "ARTEFACT, ARM, AIRFOIL, LOCAL or PINS");
  }
  return runtime::IdOf("header.subject", collection, header.subject()).status();
}

absl::Status CheckMeasuredAt(const v1::ScanHeader& header) {
  if (!header.has_measured_at()) return absl::OkStatus();
  const std::int64_t seconds = header.measured_at().seconds();
  if (seconds < 0 || seconds > kLatestClock_s) {
    return Refuse("header.measured_at.seconds", std::to_string(seconds), "a time in the years 1970 to 2199");
  }
  const int nanos = header.measured_at().nanos();
  if (nanos < 0 || nanos > 999'999'999) {
    return Refuse("header.measured_at.nanos", std::to_string(nanos), "0 to 999999999");
  }
  return absl::OkStatus();
}

// position: 0 for the rotary joint of the part's side that is on the bed, 1 for the one that it carries.
absl::Status CheckAxis(const std::string& field, double command_deg, int position, const plant::v1::Machine& machine) {
  int rotary_count = 0;
  for (const plant::v1::Joint& joint : machine.kinematics().part_side()) {
    if (joint.kind() != plant::v1::JOINT_KIND_ROTARY || rotary_count++ != position) continue;
    return CheckNumber(field, command_deg, joint.minimum(), joint.maximum());
  }
  if (command_deg == 0) return absl::OkStatus();
  return Refuse(field, command_deg,
                "0: on " + machine.name() + " the part rides on " + std::to_string(rotary_count) + " rotary axes");
}

// Which one it is the blade's part says.
absl::Status CheckStationNamed(const v1::ScanHeader& header) {
  if (header.kind() == v1::SCAN_KIND_ARTEFACT || header.kind() == v1::SCAN_KIND_ARM)
    return Refuse("header.station", header.station(), "none: an artefact has no stations");
  return runtime::CheckId("header.station", header.station());
}

// Under which it was taken.
absl::Status CheckConditions(const v1::ScanHeader& header) {
  constexpr double kWarmestC = 60;
  runtime::Refusals refusals;
  if (!header.clamping().empty()) refusals.Add(runtime::CheckId("header.clamping", header.clamping()));
  if (!header.station().empty()) refusals.Add(CheckStationNamed(header));
  if (header.has_subject_temperature_c())
    refusals.Add(CheckNumber("header.subject_temperature_c", header.subject_temperature_c(), 0, kWarmestC));
  if (header.has_scales_temperature_c())
    refusals.Add(CheckNumber("header.scales_temperature_c", header.scales_temperature_c(), 0, kWarmestC));
  if (header.has_scales_temperature_c() && !header.has_subject_temperature_c())
    refusals.Add(Refuse("header.subject_temperature_c", "not given", "one, as scales_temperature_c has"));
  if (header.travel() < v1::SCAN_TRAVEL_UNSPECIFIED || header.travel() > v1::SCAN_TRAVEL_BACKWARD)
    refusals.Add(Refuse("header.travel", std::to_string(header.travel()), "FORWARD, BACKWARD or none"));
  return refusals.status();
}

std::string UnitText(const v1::ScanHeader& header) {
  return v1::LengthUnit_Name(header.length_unit()).substr(std::string("LENGTH_UNIT_").size());
}

std::string BlockField(int index, const std::string& field) { return "block[" + std::to_string(index) + "]." + field; }

absl::Status CheckEncoding(const v1::ScanHeader& header) {
  const bool raw = header.encoding() == v1::ENCODING_RAW_PROFILES;
  if (!raw && header.encoding() != v1::ENCODING_DRACO && header.encoding() != v1::ENCODING_XYZ_F64)
    return Refuse("header.encoding", std::to_string(header.encoding()), "DRACO, XYZ_F64 or RAW_PROFILES");
  if (raw && IsSnapshot(header))
    return Refuse("header.encoding", "RAW_PROFILES", "DRACO or XYZ_F64: a snapshot has no profiles");
  if (raw && !(header.raw_step_um() > 0 && header.raw_step_um() <= kGreatestRawStepUm))
    return Refuse("header.raw_step_um", header.raw_step_um(), "> 0 and at most 100");
  if (!raw && header.raw_step_um() != 0)
    return Refuse("header.raw_step_um", header.raw_step_um(), "0: only RAW_PROFILES have steps");
  return absl::OkStatus();
}

absl::Status CheckProfiles(const v1::ScanHeader& header) {
  runtime::Refusals refusals;
  if (!(header.profile_pitch_mm() > 0 && header.profile_pitch_mm() <= kGreatestPitchMm))
    refusals.Add(Refuse("header.profile_pitch_mm", header.profile_pitch_mm(), "> 0 and at most 100"));
  if (header.columns_per_profile() < 1 || header.columns_per_profile() > metrology::kGreatestColumnCount)
    refusals.Add(Refuse("header.columns_per_profile", header.columns_per_profile(), "1 to 65536"));
  if (header.length_unit() != v1::LENGTH_UNIT_UNSPECIFIED && header.length_unit() != v1::LENGTH_UNIT_MILLIMETRE)
    refusals.Add(Refuse("header.length_unit", UnitText(header), "MILLIMETRE or none: profiles come in mm"));
  return refusals.status();
}

absl::Status CheckSnapshot(const v1::ScanHeader& header) {
  runtime::Refusals refusals;
  if (header.profile_pitch_mm() != 0)
    refusals.Add(Refuse("header.profile_pitch_mm", header.profile_pitch_mm(), "0: a snapshot has no profiles"));
  if (header.columns_per_profile() != 0)
    refusals.Add(Refuse("header.columns_per_profile", header.columns_per_profile(), "0: a snapshot has no profiles"));
  if (header.travel() != v1::SCAN_TRAVEL_UNSPECIFIED)
    refusals.Add(Refuse("header.travel", v1::ScanTravel_Name(header.travel()), "none: no encoder carries a snapshot"));
  if (header.length_unit() == v1::LENGTH_UNIT_UNSPECIFIED)
    refusals.Add(Refuse("header.length_unit", "not given",
                        "MILLIMETRE, METRE or INCH: the points of a snapshot do not say what they are in"));
  else if (header.length_unit() != v1::LENGTH_UNIT_MILLIMETRE && header.encoding() == v1::ENCODING_DRACO)
    refusals.Add(Refuse("header.length_unit", UnitText(header),
                        "MILLIMETRE of DRACO, which is kept as it was sent; XYZ_F64 for another"));
  return refusals.status();
}

// What its points are, and what follows from it.
absl::Status CheckCloud(const v1::ScanHeader& header) {
  if (!v1::CloudKind_IsValid(header.cloud()))
    return Refuse("header.cloud", std::to_string(header.cloud()), "PROFILES, SNAPSHOT or none");
  if (!v1::LengthUnit_IsValid(header.length_unit()))
    return Refuse("header.length_unit", std::to_string(header.length_unit()), "MILLIMETRE, METRE or INCH");
  return IsSnapshot(header) ? CheckSnapshot(header) : CheckProfiles(header);
}

// What a machine's sensor gives; its columns.
absl::Status CheckAgainstSensor(const v1::ScanHeader& header, const plant::v1::Machine& machine) {
  const bool gives_snapshots = machine.sensor().kind() == plant::v1::SENSOR_KIND_SNAPSHOT;
  if (gives_snapshots != IsSnapshot(header))
    return Refuse(
        "header.cloud", IsSnapshot(header) ? "SNAPSHOT" : "PROFILES",
        std::string(gives_snapshots ? "SNAPSHOT" : "PROFILES") + ", what the sensor of " + machine.name() + " gives");
  if (header.columns_per_profile() <= machine.sensor().column_count()) return absl::OkStatus();
  return Refuse(
      "header.columns_per_profile", header.columns_per_profile(),
      "1 to " + std::to_string(machine.sensor().column_count()) + ", the columns of the sensor of " + machine.name());
}

}  // namespace

bool IsSnapshot(const v1::ScanHeader& header) { return header.cloud() == v1::CLOUD_KIND_SNAPSHOT; }

double MmPerUnit(const v1::ScanHeader& header) {
  switch (header.length_unit()) {
    case v1::LENGTH_UNIT_METRE:
      return 1000;
    case v1::LENGTH_UNIT_INCH:
      return 25.4;
    default:
      return 1;
  }
}

absl::Status CheckHeader(const v1::ScanHeader& header) {
  const geometry::v1::Point& v0 = header.v0_mm();
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId("header.scan_id", header.scan_id()))
      .Add(runtime::IdOf("header.machine", "machines", header.machine()).status())
      .Add(CheckSubject(header))
      .Add(CheckNumber("header.v0_mm.x_mm", v0.x_mm(), -kGreatestCoordinateMm, kGreatestCoordinateMm))
      .Add(CheckNumber("header.v0_mm.y_mm", v0.y_mm(), -kGreatestCoordinateMm, kGreatestCoordinateMm))
      .Add(CheckNumber("header.v0_mm.z_mm", v0.z_mm(), -kGreatestCoordinateMm, kGreatestCoordinateMm))
      .Add(CheckNumber("header.a_deg", header.a_deg(), -kGreatestAngleDeg, kGreatestAngleDeg))
      .Add(CheckNumber("header.b_deg", header.b_deg(), -kGreatestAngleDeg, kGreatestAngleDeg))
      .Add(CheckNumber("header.sender_error_um", header.sender_error_um(), 0, kGreatestErrorUm))
      .Add(CheckNumber("header.error_bound_um", header.error_bound_um(), 0, kGreatestErrorUm))
      .Add(CheckMeasuredAt(header));
  if (!header.arm_series().empty()) refusals.Add(runtime::CheckId("header.arm_series", header.arm_series()));
  refusals.Add(CheckConditions(header));
  if (!header.has_v0_mm())
    refusals.Add(Refuse("header.v0_mm", "missing", "the machine's position at the start of the scan"));
  refusals.Add(CheckCloud(header));
  if (header.point_count() < 0 || header.point_count() > kGreatestScanPointCount)
    refusals.Add(Refuse("header.point_count", std::to_string(header.point_count()),
                        "1 to " + std::to_string(kGreatestScanPointCount) + ", or 0 where it is not known yet"));
  return refusals.Add(CheckEncoding(header)).status();
}

absl::Status CheckAgainstMachine(const v1::ScanHeader& header, const plant::v1::Machine& machine) {
  runtime::Refusals refusals;
  refusals.Add(CheckAxis("header.a_deg", header.a_deg(), 0, machine))
      .Add(CheckAxis("header.b_deg", header.b_deg(), 1, machine));
  refusals.Add(CheckAgainstSensor(header, machine));
  const std::string& serial = machine.sensor().serial_number();
  if (!header.sensor_serial_number().empty() && !serial.empty() && header.sensor_serial_number() != serial)
    refusals.Add(Refuse("header.sensor_serial_number", header.sensor_serial_number(),
                        serial + ", the sensor of " + machine.name()));
  return refusals.status();
}

absl::Status CheckAgainstTolerance(const v1::ScanHeader& header, double tightest_tolerance_mm) {
  const double limit_um = kToleranceShare * 1e3 * tightest_tolerance_mm;
  const double stored_um = header.encoding() == v1::ENCODING_DRACO ? 0 : 1e3 * ErrorBoundMm(header);
  const double error_um = header.sender_error_um() + stored_um;
  if (error_um <= limit_um) return absl::OkStatus();
  return Refuse(stored_um > header.sender_error_um() ? "header.error_bound_um" : "header.sender_error_um", error_um,
                "with the other at most " + Rounded(limit_um) +
                    ", a tenth of the tightest position tolerance of the blade's part");
}

absl::Status CheckBlock(const v1::ScanHeader& header, const UploadSoFar& so_far, const v1::ScanBlock& block) {
  const int expected = so_far.block_count;
  if (block.index() != expected) {
    return Refuse(BlockField(expected, "index"), std::to_string(block.index()),
                  std::to_string(expected) + ", the next, or one that came already");
  }
  if (expected >= kMostBlocks)
    return Refuse(BlockField(expected, "index"), std::to_string(block.index()),
                  "at most " + std::to_string(kMostBlocks) + " blocks in a scan, of more points each");
  if (expected >= kMostSmallBlocks && so_far.point_count < (expected - kMostSmallBlocks + 1) * kLeastMeanPointCount)
    return Refuse(BlockField(expected, "index"),
                  std::to_string(block.index()) + " after " + std::to_string(so_far.point_count) + " points",
                  "at most " + std::to_string(kMostSmallBlocks) + " blocks, and one more for every " +
                      std::to_string(kLeastMeanPointCount) + " points");
  if (block.point_count() < 1 || block.point_count() > kGreatestBlockPointCount) {
    return Refuse(BlockField(expected, "point_count"), std::to_string(block.point_count()),
                  "1 to " + std::to_string(kGreatestBlockPointCount));
  }
  const bool told = header.point_count() > 0;
  const std::int64_t left = (told ? header.point_count() : kGreatestScanPointCount) - so_far.point_count;
  if (block.point_count() > left) {
    return Refuse(BlockField(expected, "point_count"), std::to_string(block.point_count()),
                  "at most the " + std::to_string(left) +
                      (told ? " that header.point_count leaves" : " that a scan may still have"));
  }
  const auto payload_bytes = static_cast<std::int64_t>(block.payload().size());
  if (header.encoding() == v1::ENCODING_XYZ_F64) {
    const std::int64_t wanted = 24 * static_cast<std::int64_t>(block.point_count());
    if (payload_bytes == wanted) return absl::OkStatus();
    return Refuse(BlockField(expected, "payload"), std::to_string(payload_bytes) + " bytes",
                  std::to_string(wanted) + ", 24 a point");
  }
  if (header.encoding() == v1::ENCODING_RAW_PROFILES) return absl::OkStatus();  // its parser counts
  const std::int64_t limit = kBlockOverheadBytes + kGreatestBytesPerPoint * block.point_count();
  if (payload_bytes > limit) {
    return Refuse(BlockField(expected, "payload"), std::to_string(payload_bytes) + " bytes",
                  "at most " + std::to_string(limit) + " for its points");
  }
  const auto draco = metrology::InspectHeader(block.payload(), kGreatestBlockPointCount);
  if (!draco.ok()) {
    return Refuse(BlockField(expected, "payload"), std::string(draco.status().message()), "a sequential Draco cloud");
  }
  if (draco->point_count != block.point_count()) {
    return Refuse(BlockField(expected, "payload"), std::to_string(draco->point_count) + " points in the Draco header",
                  std::to_string(block.point_count()) + ", the block's point_count");
  }
  return absl::OkStatus();
}

absl::Status CheckStatistics(const v1::ScanHeader& header, const plant::v1::Sensor& sensor, int block_index,
                             const BlockStatistics& statistics) {
  const std::string field = BlockField(block_index, "payload");
  if (statistics.not_finite_count > 0) {
    return Refuse(field, std::to_string(statistics.not_finite_count) + " points with NaN or infinity", "none");
  }
  const double margin_mm =
      std::max(kLeastMarginMm, kNoiseMargins * sensor.noise_um() * 1e-3) + header.sender_error_um() * 1e-3;
  const double z_limit_mm = sensor.range_mm() / 2 + margin_mm;
  const double y_limit_mm =
      (sensor.mid_range_mm() + sensor.range_mm() / 2) * std::tan(sensor.line_angle_deg() / 2 * runtime::kRadPerDeg) +
      margin_mm;
  // Of profiles x is the encoder's reading; a snapshot's view is as wide along x.
  const std::array<double, 3> limit_mm = {IsSnapshot(header) ? y_limit_mm : kGreatestEncoderMm, y_limit_mm, z_limit_mm};
  for (std::size_t i = 0; i < 3; ++i) {
    for (const double value_mm : {statistics.minimum_mm[i], statistics.maximum_mm[i]}) {
      if (std::abs(value_mm) <= limit_mm[i]) continue;
      return Refuse(field + "." + "xyz"[i] + "_mm", value_mm,
                    "within +-" + Rounded(limit_mm[i]) + ", the range of the sensor");
    }
  }
  if (statistics.greatest_backstep_mm > 0) {
    return Refuse(field + ".x_mm", -statistics.greatest_backstep_mm,
                  "profiles by growing x: x runs backwards by that much");
  }
  if (statistics.greatest_column_count > header.columns_per_profile()) {
    return Refuse(field, std::to_string(statistics.greatest_column_count) + " points in one profile",
                  "at most header.columns_per_profile, " + std::to_string(header.columns_per_profile()));
  }
  return absl::OkStatus();
}

absl::Status CheckEnd(const v1::ScanHeader& header, const v1::ScanEnd& end, const UploadSoFar& so_far,
                      const std::string& sha256) {
  if (so_far.block_count == 0) return Refuse("end.block_count", "0", "at least one block with points");
  if (end.block_count() != so_far.block_count) {
    return Refuse("end.block_count", std::to_string(end.block_count()),
                  std::to_string(so_far.block_count) + ", the blocks that came");
  }
  if (end.point_count() != so_far.point_count) {
    return Refuse("end.point_count", std::to_string(end.point_count()),
                  std::to_string(so_far.point_count) + ", the points that came");
  }
  if (header.point_count() != 0 && header.point_count() != so_far.point_count) {
    return Refuse("header.point_count", std::to_string(header.point_count()),
                  "the " + std::to_string(so_far.point_count) + " points of the " + std::to_string(so_far.block_count) +
                      " blocks that came before the end");
  }
  if (end.sha256() != sha256) {
    return Refuse("end.sha256", end.sha256(), sha256 + ", the digest of the digests of the blocks that came");
  }
  return absl::OkStatus();
}

double ErrorBoundMm(const v1::ScanHeader& header) {
  return header.error_bound_um() > 0 ? header.error_bound_um() * 1e-3 : metrology::kDefaultErrorBoundMm;
}

}  // namespace sixpoint::ingest
