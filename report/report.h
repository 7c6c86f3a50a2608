// What a report of one blade tells, as plain data: both writers (html.h, pdf.h) tell all of it, from one document (document.h).
//
// Lengths in mm, deviations of surfaces in um, angles in degrees, times in UTC. What was not measured is unset and is told as "not measured"
// with its reason: never as 0, never as conform.
#pragma once

#include <absl/status/status.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "exchange/inspected_part.h"
#include "report/picture.h"

namespace sixpoint::report {

using exchange::Verdict;
using Time = std::chrono::system_clock::time_point;

// What another instrument, or another positioning of the part, says of the same characteristic, in its unit. It is judged by nobody.
struct OtherValue {
  std::string source;
  double value = 0;
  std::optional<double> expanded_uncertainty;  // 95 %
};

// One line of the drawing, and what was found of it.
struct Characteristic {
  std::string id;           // "G1/H1/position", a balloon's number
  std::string requirement;  // as the drawing says it
  std::string designator;   // class: KEY, CRITICAL, MAJOR; empty: none
  std::string unit;         // "mm", "um", "deg", or another's own
  std::optional<double> nominal, lower, upper;
  std::optional<double> value;                 // none exactly where it was not measured
  std::optional<double> expanded_uncertainty;  // 95 %
  Verdict verdict = Verdict::kNotMeasured;
  std::string reason;  // why it was not measured, or why nothing is said; else empty
  bool judged = true;  // false: nothing is asked of it, so that it has neither limits nor a verdict
  std::vector<OtherValue> others = {};
};

struct CharacteristicGroup {
  std::string name;       // "Holes", "Profile"
  std::string fit_state;  // after which alignment its values are told
  std::vector<Characteristic> characteristics;
  std::string rule = {};  // that they are judged by; empty: the report's
};

// Part frame.
struct Hole {
  std::string id;
  std::array<double, 3> nominal_mm{};
  std::optional<std::array<double, 3>> displacement_mm;                       // of its start: measured less nominal
  std::optional<double> position_expanded_uncertainty_mm, position_limit_mm;  // of the displacement's length
  std::optional<double> inclination_deg, inclination_expanded_uncertainty_deg, inclination_limit_deg;
  Verdict verdict = Verdict::kNotMeasured;
  std::string reason;
  bool judged = true;  // as Characteristic's
};

// Of a deviation map: of the whole, or of some patches. Positive outside.
struct RegionDeviation {
  std::string name, fit_state;
  double area_mm2 = 0, seen_area_mm2 = 0;
  struct Values {
    double mean_um = 0, rms_um = 0;                 // by area, of the patches' means
    double p05_um = 0, p50_um = 0, p95_um = 0;      // of points
    double lowest_um = 0, highest_um = 0;           // of the patches' means
    std::optional<double> expanded_uncertainty_um;  // of a patch's mean, the greatest of lowest's and highest's
  };
  std::optional<Values> values;  // none where nothing was seen
  std::string reason;
};

// Section frame.
struct OutlinePoint {
  double x_mm = 0, y_mm = 0;
  double normal_x = 0, normal_y = 0;  // outward, unit
  double deviation_mm = 0;            // of measured points: from the nominal outline, along the normal
};

// Of an outline what was seen in one piece: between pieces lies a gap.
struct OutlinePiece {
  std::vector<OutlinePoint> points;
  bool closed = false;  // the last point is followed by the first
};

struct PlaneCircle {
  double x_mm = 0, y_mm = 0, radius_mm = 0;
};

struct SectionOutlines {
  std::vector<OutlinePiece> nominal, measured;
  std::optional<double> lower_mm, upper_mm;  // profile tolerance about the nominal
  std::optional<PlaneCircle> greatest_circle, leading_circle, trailing_circle;
  std::optional<std::array<std::array<double, 2>, 2>> chord_mm;  // from leading to trailing end
};

struct Section {
  std::string name, fit_state;
  double height_mm = 0;
  SectionOutlines outlines;  // without a nominal piece there is no plot
  std::vector<Characteristic> parameters;
};

struct CalibrationUsed {
  std::string name, kind, state;
  std::optional<Time> valid_from, valid_until;
};

struct ScanUsed {
  std::string name;
  std::string sha256;  // of its bytes, 64 hexadecimal digits
  std::optional<Time> received_at;
  std::optional<std::int64_t> point_count;
};

// What each source contributes to one value's standard uncertainty.
struct Budget {
  std::string of, unit;
  struct Line {
    std::string source;
    double standard_uncertainty = 0;
    std::optional<double> degrees_of_freedom;
  };
  std::vector<Line> lines;
  std::optional<double> expanded_uncertainty;
};

struct SoftwareVersion {
  std::string name, version;
};

// Another instrument, whose values stand beside ours.
struct InstrumentUsed {
  std::string name, certificate, measurement;
  std::string file_sha256;  // of the file that its values came in
  std::optional<Time> measured_at;
};

struct Traceability {
  std::vector<std::string> results, registrations;
  std::string method, fit_state, machine, sensor, requested_by;
  std::vector<SoftwareVersion> software;
  std::vector<CalibrationUsed> calibrations;
  std::vector<ScanUsed> scans;
  std::vector<InstrumentUsed> instruments = {};
  std::vector<Budget> budgets;
};

// A deviation map seen from fixed sides (deviation_picture.h).
struct DeviationPicture {
  std::string title = {};                             // of which map; empty where there is one
  std::vector<std::shared_ptr<const Picture>> views;  // their names are the sides'
  double mm_per_px = 0, scale_um = 0, band_um = 0;
};

struct Report {
  std::string title, plant, serial, part, part_revision, drawing, drawing_revision, work_order, operation;
  Time measured_at;  // of the result; the files' date, too
  Verdict verdict = Verdict::kNotMeasured;
  std::string decision_rule, reason;
  std::vector<CharacteristicGroup> groups;
  std::vector<Hole> holes;
  std::vector<RegionDeviation> regions;
  std::vector<Section> sections;
  std::vector<DeviationPicture> deviation_pictures;  // of maps: the first one on the first page
  std::string no_picture_reason;
  std::size_t pictures_left_out = 0;  // maps beyond those that are drawn
  Traceability traceability;
};

inline constexpr std::size_t kMostRows = 20000;           // of all tables together
inline constexpr std::size_t kMostOutlinePoints = 20000;  // of one section's outlines
inline constexpr std::size_t kMostSections = 100;
inline constexpr std::size_t kMostPictures = 12;  // of one map
inline constexpr std::size_t kMostPicturedMaps = 6;

// What both writers ask before they write a byte. INVALID_ARGUMENT names the field: numbers that are not finite or beyond 1e9, a value beside
// the verdict NOT_MEASURED or none beside another, an uncertainty without a value or below 0, an expanded uncertainty or limits that cannot
// be, digests that are none, more than the bounds above, a verdict or limits of what is not judged, and a blade that is conform while not all
// that is judged of it is.
// Texts are never refused: what is too long is cut, with dots, and what no page can show is "?" (plain_text.h).
absl::Status Check(const Report& report);

// All characteristics that are judged: of groups, then of sections.
std::vector<const Characteristic*> JudgedOf(const Report& report);

}  // namespace sixpoint::report
