#include "simulator/fixture.h"

#include <cmath>

#include "metrology/frames/angles.h"
#include "refusal/refusal.h"

namespace sixpoint::simulator {
namespace {

// Tilted by A, the scanner looks past the one at the ends of the other.
constexpr double kBetween_mm = 25;
constexpr double kOver_mm = 9;  // of a neighbour, that a scan of a part has too
constexpr double kTurn_deg = 20;

}  // namespace

std::vector<DesignedStation> UsualStations(const DesignedPart& part) {
  Eigen::Isometry3d right = Eigen::Isometry3d::Identity();
  right.translate(Eigen::Vector3d(0, 0, part.airfoil.span_mm + kBetween_mm));
  right.rotate(Eigen::AngleAxisd(kTurn_deg * metrology::kPi / 180, Eigen::Vector3d::UnitZ()));
  return {{kLeftStation, part.zero_from_part_nominal}, {kRightStation, part.zero_from_part_nominal * right}};
}

absl::StatusOr<DesignedPart> AtStation(const DesignedPart& part, const std::string& station) {
  if (part.stations.empty() && station.empty()) return part;
  std::string known;
  for (const DesignedStation& one : part.stations) {
    if (one.name == station) {
      DesignedPart there = part;
      there.zero_from_part_nominal = one.zero_from_part_nominal;
      return there;
    }
    known += (known.empty() ? "" : ", ") + one.name;
  }
  return Refuse("station", station,
                known.empty() ? "none: the part has no stations" : "a station of the part (" + known + ")");
}

std::vector<Eigen::Isometry3d> NeighboursByHand(const DesignedPart& part, const std::string& station, double shift_mm,
                                                double turn_deg, std::uint64_t seed) {
  std::vector<Eigen::Isometry3d> neighbours;
  for (const DesignedStation& one : part.stations) {
    if (one.name == station) continue;
    DesignedPart there = part;
    there.zero_from_part_nominal = one.zero_from_part_nominal;
    neighbours.push_back(ClampedByHand(there, shift_mm, turn_deg, Random::StreamSeed(seed, neighbours.size())));
  }
  return neighbours;
}

ScanPlan OverNeighbours(const ScanPlan& strip) {
  ScanPlan longer = strip;
  const double more_mm = strip.pitch_mm * std::floor((kBetween_mm + kOver_mm) / strip.pitch_mm);
  longer.first_x_mm -= more_mm;
  longer.last_x_mm += more_mm;
  return longer;
}

}  // namespace sixpoint::simulator
