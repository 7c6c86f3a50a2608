// What was found of one part, as it leaves the plant to systems that read other formats, and as it comes from them: plain data,
// lengths in mm, angles in degrees, times in UTC.
#pragma once

#include <absl/status/status.h>

#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace sixpoint::exchange {

// By ISO 14253-1, as in the contract (inspection/v1): conform and not conform only outside the expanded uncertainty.
enum class Verdict { kConform, kNotConform, kUndecidable, kNotMeasured };

// As the part's record had it when it was judged.
struct Characteristic {
  enum class Kind {
    kPosition,  // distance of a hole's start from its nominal start, mm; `upper` is the greatest distance: half the zone's diameter
    kInclination,  // angle of a hole's axis with its nominal axis, deg
    kProfile,      // greatest distance of a surface from nominal, mm; `upper` is half the zone's width
    kOther,        // what other systems measure: read, and written nowhere but to CSV and AQDEF
    kLength,       // what a drawing asks in mm beside those: a displacement, a diameter, a chord
    kAngle,        // in deg: stagger, twist
    kRatio,        // of lengths, without a unit: P/D
  };
  std::string name;  // "G1/H1/position", "G1/H1/inclination", a drawing's number for a profile; each once in a part
  Kind kind = Kind::kPosition;
  std::string unit;  // "mm", "deg", or "1" of a ratio: of nominal, limits, value and uncertainty
  double nominal = 0;
  std::optional<double> lower, upper;  // none: there is no limit on that side
};

// A place on the nominal surface, what was measured there along its normal.
struct DeviationPoint {
  std::array<double, 3> nominal_mm, normal;  // part frame; outward, unit
  double deviation_mm = 0;                   // positive outside
};

// Of the characteristic at the same index.
struct MeasuredValue {
  std::optional<double> value;                 // none exactly where it was not measured
  std::optional<double> expanded_uncertainty;  // 95 %
  // Of profiles alone, mm: the least and the greatest deviation, positive outside.
  std::optional<double> worst_negative, worst_positive;
  std::vector<DeviationPoint> points;  // of profiles alone: written to QIF, where they were asked for
  Verdict verdict = Verdict::kNotMeasured;
  std::string reason;  // why it was not measured, or why nothing is said; else empty
  bool does_not_count =
      false;  // read only: whoever measured it says that the value is none (QIF SYSERROR, AQDEF K0002)
};

struct InspectedPart {
  std::string result;  // "inspections/UUID", "deviations/UUID" or "assessments/UUID"
  std::string serial, part;
  int part_revision = 0;
  std::string machine;
  int machine_revision = 0;
  std::string sensor_model, sensor_serial_number;  // empty: not known
  std::string work_order, operation, requested_by, software_version, decision_rule, method, registration;
  std::vector<std::string> calibrations, scans;
  std::chrono::system_clock::time_point recorded_at;
  Verdict verdict = Verdict::kNotMeasured;  // of the whole part
  std::vector<Characteristic> characteristics;
  std::vector<MeasuredValue> values;  // as many
};

// What every writer asks of a part before it writes a byte: as many values as characteristics, names once and not empty, units of their
// kinds, finite numbers below 1e15, a value exactly where it was measured, points of profiles alone, texts of UTF-8 without control characters beside tab and
// ends of line. INVALID_ARGUMENT names the field.
absl::Status Check(const InspectedPart& part);

// Of one part revision, judged by the same characteristics with the same limits.
bool SameCharacteristics(const InspectedPart& one, const InspectedPart& other);

// The worst of them: not conform, not measured, undecidable, conform. Of none: not measured.
Verdict WorstOf(const std::vector<MeasuredValue>& values);

}  // namespace sixpoint::exchange
