// A made-up result, as many characteristics as asked, and whether two results are the same to the last bit.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "exchange/inspected_part.h"

namespace sixpoint::exchange {

// Of each four one is not measured, not conform, undecidable or conform.
inline InspectedPart SamplePart(int characteristics, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 0.2);
  InspectedPart part;
  char uuid[48];
  std::snprintf(uuid, sizeof uuid, "0198a3c0-0000-7000-8000-%012x", seed);
  part.result = std::string("inspections/") + uuid;
  part.serial = "SN-" + std::to_string(seed);
  part.part = "vane";
  part.part_revision = 3;
  part.machine = "mill-1";
  part.machine_revision = 7;
  part.sensor_model = "LS-25";
  part.sensor_serial_number = "4711";
  part.work_order = "4711-A";
  part.operation = "0020";
  part.requested_by = "users/jane via services/inspection";
  part.software_version = "0.1.0";
  part.decision_rule = "ISO 14253-1: conform where value + U <= tolerance";
  part.method = "SIX_POINT";
  part.registration = "registrations/0198a3c0-0000-7000-8000-000000000abc";
  part.calibrations = {"calibrations/1", "calibrations/2"};
  part.scans = {"scans/a", "scans/b"};
  part.recorded_at = std::chrono::system_clock::time_point(std::chrono::seconds(1795000000 + seed));
  part.verdict = Verdict::kNotConform;
  using Kind = Characteristic::Kind;
  for (int i = 0; i < characteristics; ++i) {
    Characteristic c;
    constexpr Kind kKinds[] = {Kind::kPosition, Kind::kInclination, Kind::kProfile,
                               Kind::kLength,   Kind::kAngle,       Kind::kRatio};
    c.kind = kKinds[i % 6];
    c.unit = c.kind == Kind::kInclination || c.kind == Kind::kAngle ? "deg" : c.kind == Kind::kRatio ? "1" : "mm";
    const std::string hole = "G1/H" + std::to_string(i);
    c.name = c.kind == Kind::kPosition      ? hole + "/position"
             : c.kind == Kind::kInclination ? hole + "/inclination"
                                            : "12." + std::to_string(i);
    c.upper = 0.1 + 0.001 * i;
    if (c.kind == Kind::kProfile) c.lower = -*c.upper;
    if (i % 6 > 2) {
      c.nominal = 0.05 + 0.1 * i;
      c.lower = c.nominal - 0.01;
      c.upper = c.nominal + 0.02;
    }
    MeasuredValue v;
    v.verdict = static_cast<Verdict>(i % 4);
    if (v.verdict == Verdict::kNotMeasured) {
      v.reason = "no pin stands in it";
    } else {
      v.value = uniform(random);
      v.expanded_uncertainty = uniform(random) / 10;
      if (c.kind == Kind::kProfile) {
        v.worst_negative = -uniform(random);
        v.worst_positive = uniform(random);
      }
    }
    part.characteristics.push_back(c);
    part.values.push_back(v);
  }
  return part;
}

inline void ExpectSameCharacteristics(const InspectedPart& a, const InspectedPart& b) {
  ASSERT_EQ(a.characteristics.size(), b.characteristics.size());
  for (std::size_t i = 0; i < a.characteristics.size(); ++i) {
    const Characteristic &x = a.characteristics[i], &y = b.characteristics[i];
    SCOPED_TRACE(x.name);
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.kind, y.kind);
    EXPECT_EQ(x.unit, y.unit);
    EXPECT_EQ(x.nominal, y.nominal);
    EXPECT_EQ(x.lower, y.lower);
    EXPECT_EQ(x.upper, y.upper);
  }
}

inline void ExpectSameValues(const InspectedPart& a, const InspectedPart& b) {
  ASSERT_EQ(a.values.size(), b.values.size());
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const MeasuredValue &x = a.values[i], &y = b.values[i];
    SCOPED_TRACE(a.characteristics[i].name);
    EXPECT_EQ(x.value, y.value);
    EXPECT_EQ(x.expanded_uncertainty, y.expanded_uncertainty);
    EXPECT_EQ(x.worst_negative, y.worst_negative);
    EXPECT_EQ(x.worst_positive, y.worst_positive);
    EXPECT_EQ(x.verdict, y.verdict);
    EXPECT_EQ(x.reason, y.reason);
  }
}

inline void ExpectSame(const InspectedPart& a, const InspectedPart& b) {
  for (const auto text :
       {&InspectedPart::result, &InspectedPart::serial, &InspectedPart::part, &InspectedPart::machine,
        &InspectedPart::sensor_model, &InspectedPart::sensor_serial_number, &InspectedPart::work_order,
        &InspectedPart::operation, &InspectedPart::requested_by, &InspectedPart::software_version,
        &InspectedPart::decision_rule, &InspectedPart::method, &InspectedPart::registration})
    EXPECT_EQ(a.*text, b.*text);
  EXPECT_EQ(a.part_revision, b.part_revision);
  EXPECT_EQ(a.machine_revision, b.machine_revision);
  EXPECT_EQ(a.calibrations, b.calibrations);
  EXPECT_EQ(a.scans, b.scans);
  EXPECT_EQ(a.recorded_at, b.recorded_at);
  EXPECT_EQ(a.verdict, b.verdict);
  ExpectSameCharacteristics(a, b);
  ExpectSameValues(a, b);
}

// Of ../shared, what of it is there.
inline std::filesystem::path SharedStandards() {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  return std::filesystem::path(shared ? shared : "") / "data" / "standards";
}

inline std::string FileText(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

}  // namespace sixpoint::exchange
