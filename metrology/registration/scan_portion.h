// A scan thinned for registration and mapped to the part's place at A = B = 0.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "metrology/registration/compact_points.h"
#include "metrology/registration/machine_calibration.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

struct ScanPortion {
  std::string id;
  double a_rad = 0;  // as reached: the command itself where no table is applied
  double b_rad = 0;
  double commanded_a_rad = 0;
  double commanded_b_rad = 0;
  std::int64_t scan_point_count = 0;    // before thinning; points that are not finite are left out
  std::int64_t out_of_reach_count = 0;  // metres from the others: not kept
  bool is_seen_from_sensor = true;      // down its z; of a snapshot's points nobody knows from where
  Eigen::Affine3d zero_from_sensor =
      Eigen::Affine3d::Identity();  // the calibrated mapping; sheared (CONF 12) of profiles
  CompactPoints sensor;             // every k-th point, in scan order
  Points dense_sensor_mm;           // every point near the places asked for
  Points dense_zero_mm;

  Eigen::Vector3d zero_mm(std::size_t i) const { return zero_from_sensor * sensor[i]; }
};

struct Thinning {
  std::int64_t target_count = 25'000;  // points to keep of a scan
  Points dense_places_mm;              // at A = B = 0: keep every point near these
  double dense_radius_mm = 8;
};

ScanPortion Thin(const LineScan& scan, const MachineCalibration& calibration, const Thinning& thinning);

// The same, the points coming in pieces: a scan need never be in memory as a whole.
class Thinner {
 public:
  // `scan`: everything but its points, of which there will be `point_count`.
  Thinner(const LineScan& scan, std::int64_t point_count, const MachineCalibration& calibration,
          const Thinning& thinning);
  void Add(const Points& points_mm);
  ScanPortion Take() { return std::move(portion_); }

  // Pieces of a scan in their order, each made (decoded) once by `piece` for all thinners: as Add of each in turn, to the bit, but a few are
  // made and looked through at a time, by a thread each. What cannot be made ends it.
  static absl::Status AddPieces(std::size_t count, const std::function<absl::StatusOr<Points>(std::size_t i)>& piece,
                                int thread_count, const std::vector<Thinner*>& thinners);

  // All that the portion follows from beside the points, but the dense places. What is equal in it, to the bit, gives the same portion.
  std::vector<double> Determinants() const;

 private:
  struct Sifted;
  // Of points after so many that are finite.
  Sifted Sift(const Points& points_mm, std::int64_t finite_count) const;
  void Keep(const Sifted& sifted);

  const Thinning thinning_;
  const SensorPose sensor_;
  ScanPortion portion_;
  std::int64_t stride_ = 1;
  std::int64_t finite_count_ = 0;
};

}  // namespace sixpoint::metrology
