// A machined blade against its CAD: deviation of every point, and each hole from the pin in it
// (docs/methods/inspection.md).
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "metrology/correction/registered_pose.h"
#include "metrology/inspection/bore.h"
#include "metrology/inspection/cylinder_form.h"
#include "metrology/inspection/hole_diameter.h"
#include "metrology/inspection/hole_displacement.h"
#include "metrology/inspection/hole_error.h"
#include "metrology/inspection/hole_regions.h"
#include "metrology/inspection/part_mapping.h"
#include "metrology/inspection/pin.h"
#include "metrology/inspection/pitch.h"
#include "metrology/inspection/verdict.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/parallel/keep_going.h"
#include "metrology/scanner/line_scanner.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct InspectedHole {
  std::string group, name;
  NominalPin pin;
  double position_tolerance_mm = 0;
  double inclination_tolerance_rad = 0;
};

// What a hole was measured by.
enum class HoleInstrument { kNone, kPin, kBore };

struct HoleFinding {
  Verdict verdict = Verdict::kNotMeasured;
  Verdict position_verdict = Verdict::kNotMeasured;
  Verdict inclination_verdict = Verdict::kNotMeasured;
  HoleError error;                                  // meaningful where measured
  double position_expanded_uncertainty_mm = 0;      // 95 %
  double inclination_expanded_uncertainty_rad = 0;  // 95 %
  // The budget of the position: of its variance, in um^2. The greatest first; what is nothing is left out.
  std::vector<UncertaintyComponent> components;
  double degrees_of_freedom = std::numeric_limits<double>::infinity();  // of all together; both are widened for them
  double pin_radius_mm = 0;                                             // of the pin, or of the bore
  double pin_half_play_mm = 0;                                          // in the expanded uncertainties
  // How far the other positionings (InspectionOptions) move the hole, at most: in the expanded uncertainties.
  double positioning_difference_mm = 0, positioning_difference_rad = 0;
  // 95 %, without them: a drawing that names its datums asks for no other positioning.
  double position_stated_expanded_uncertainty_mm = 0, inclination_stated_expanded_uncertainty_rad = 0;
  int point_count = 0;
  double pin_residual_rms_um = 0;
  std::string reason;  // why it was not measured, or not judged although it was

  HoleInstrument instrument = HoleInstrument::kNone;
  // Set where it was measured.
  std::optional<HoleDisplacement> displacement;
  std::optional<CylinderForm> form;         // of the pin, or of the bore
  std::optional<PinDiameter> pin_diameter;  // by a pin alone
  HoleDiameterFinding hole_diameter;
  std::string bore_reason;  // why its bore was not measured, where no pin was
};

// Signed, positive outside the CAD.
struct DeviationSummary {
  double minimum_um = 0, maximum_um = 0, rms_um = 0;
  double p05_um = 0, p50_um = 0, p95_um = 0;
  std::int64_t point_count = 0;
  // Set aside: within a hole's pin region, or farther from the CAD than InspectionOptions::farthest_mm.
  std::int64_t excluded_count = 0;
};

struct BladeFindings {
  Verdict verdict = Verdict::kNotMeasured;  // the worst of the holes
  std::vector<HoleFinding> holes;           // in the order given
  std::vector<HolePitch> pitches;           // of each hole and the next of its group, in the order given
  DeviationSummary deviation;
};

struct InspectionOptions {
  int threads = 2;
  double farthest_mm = 1;  // a point farther from the CAD is not of this part (chip, fixture)
  // A pin's point is at least this far off the CAD. Where a casting stands proud beside the hole, that is no pin: farther off is tried.
  std::vector<double> pin_clearances_mm = {0.15, 0.3, 0.5, 0.8};
  // A pin's axis may lie this far from the nominal, and nearer than half of the way to the next hole: what is farther is that one's.
  double search_mm = 0.3;
  double longest_pin_mm = 25;
  std::int64_t greatest_point_count = 60'000'000;
  PinLimits pin;
  BoreLimits bore;
  // Where other positionings of the same scans put the part, where that is beyond what noise and calibrations explain. The
  // part then is none that its CAD describes, and which of them the drawing means decides: what lies between them is taken
  // as equally likely (GUM 4.3.7).
  std::vector<Eigen::Isometry3d> other_zero_from_part;
  // zero_from_part of the nominal parts at a fixture's other stations: what is nearer to one of them than to this part is no point of a pin.
  std::vector<Eigen::Isometry3d> neighbours;
  std::function<bool()> keep_going;  // false: stop with CANCELLED; asked between chunks
};

// A cylinder about the nominal axis in which the hole's pin must stand.
HoleRegion PinRegionOf(const InspectedHole& hole, const InspectionOptions& options);

// Scans are added one after another and need not be kept: what stays is one float per point and the points near holes.
// Not thread-safe; computes on its own threads. The same scans in the same order give the same bits on any number.
class BladeInspection {
 public:
  // sensor and axes: those that the pose was registered with; the scans' angles are taken by its tables.
  BladeInspection(std::shared_ptr<const Surface> surface, std::vector<InspectedHole> holes, RegisteredPose pose,
                  SensorPose sensor, RotaryAxes axes, InspectionOptions options);
  // RESOURCE_EXHAUSTED beyond greatest_point_count.
  absl::Status Add(const LineScan& scan);
  // The same in pieces: the scan without its points, then its points as they come.
  void Begin(const LineScan& scan);
  absl::Status AddPoints(const Points& points_mm);
  // As AddPoints of each in turn, to the bit; but several are made (decoded) and compared at a time, by a thread each. `piece` is called
  // once for each, by any thread, and what it cannot make ends the call.
  absl::Status AddPieces(std::size_t count, const std::function<absl::StatusOr<Points>(std::size_t i)>& piece);
  // FAILED_PRECONDITION where no point was near the CAD.
  absl::StatusOr<BladeFindings> Finish();

 private:
  struct PinPoint {
    Eigen::Vector3d in_part_mm, in_sensor_mm;
    std::uint32_t scan;
    float deviation_mm;  // infinite where the CAD is not near
  };
  struct Chunk;
  struct Compared;
  struct Piece;

  // What points of the last scan come to; by any thread, on so many more.
  Piece Look(const Points& points_mm, int threads, KeepGoing* keep_going) const;
  // In the order of the points.
  absl::Status Take(const Piece& piece);
  absl::Status Count(std::int64_t point_count);
  // Where they lie in the part, and how far from its surface.
  Compared Compare(const Points& points_mm, int threads, KeepGoing* keep_going) const;
  // What is a deviation, what belongs to a pin, and what is set aside.
  void Sort(const Points& points_mm, std::size_t begin, std::size_t end, const Compared& compared, Chunk* chunk) const;
  // Of points of pins, those of another part beside this one.
  void LeaveOutNeighbours(std::vector<std::pair<std::uint32_t, PinPoint>>* pin_points) const;
  // The verdicts that the values and their uncertainties allow.
  void Judge(const InspectedHole& hole, const PinPlay& play, HoleFinding* finding) const;
  std::vector<MovedHole> MovedBy(const NominalPin& nominal, const HoleError& error) const;
  // Into the standard uncertainties.
  static void AddPositioning(const std::vector<MovedHole>& moved, HoleFinding* finding);
  // A hole's finding, and what its pitches need of it.
  struct Judged {
    HoleFinding finding;
    MeasuredHole measured;
  };
  // By its pin, else by its bore.
  Judged JudgedHole(std::size_t hole) const;
  // By the pin whose points are farther off the CAD than that.
  Judged ByPin(std::size_t hole, double clearance_mm) const;
  Judged ByBore(std::size_t hole) const;
  // The cylinder that was fitted to these points: the hole's values, and its verdict.
  Judged ByCylinder(std::size_t hole, const NominalPin& pin, const PinFit& fit, const std::vector<PinPoint>& points,
                    HoleInstrument instrument) const;
  std::vector<HolePitch> PitchesOf(const std::vector<Judged>& holes) const;
  // A named cause's part of the covariance of a pin's parameters.
  struct Part {
    CylinderSource cause;
    Eigen::Matrix<double, 5, 5> covariance;
  };
  std::vector<Part> PartsOf(const PinFit& fit, const std::vector<PinPoint>& points, const PinPlay& play,
                            HoleInstrument instrument, const CylinderForm& form) const;
  // The budget of the position, and both expanded uncertainties.
  static void Expand(const std::vector<Part>& parts, HoleFinding* finding);
  DeviationSummary Summarise();  // puts the deviations in another order

  std::shared_ptr<const Surface> surface_;
  std::vector<InspectedHole> holes_;
  HoleRegions regions_;             // in which the holes' pins must stand
  std::vector<std::size_t> bored_;  // the holes that are wide enough to be seen into
  HoleRegions bore_regions_;        // of these, in which the walls of their bores must lie
  std::vector<double> reach_mm_;    // per hole: how far its pin's axis may lie from the nominal
  PartMapping mapping_;
  InspectionOptions options_;
  std::vector<ScanPlace> scans_;
  std::vector<std::vector<PinPoint>> pin_points_;   // per hole
  std::vector<std::vector<PinPoint>> bore_points_;  // per hole
  std::vector<float> deviations_mm_;
  double square_sum_mm2_ = 0;
  std::int64_t excluded_count_ = 0;
  std::int64_t seen_count_ = 0;
};

}  // namespace sixpoint::metrology
