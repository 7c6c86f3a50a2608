// The scans of a plant: what is scanned how, and what the scanner then reads.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "simulator/plant_world.h"

namespace sixpoint::simulator {

inline constexpr const char* kFinishedSerial = "SN-0001";
inline constexpr const char* kCastingSerial = "SN-0002";
inline constexpr double kGreatestCasting_mm = 0.3;

struct PlannedScan {
  std::string id, kind, serial;  // serial: empty of the artefact
  std::string series;            // of the arm; that of kind arm is swung before each
  ScanPlan plan;
  bool backward = false;  // how the encoder goes
  int approach = 0;       // scans of one number were taken without moving the rotary axes in between
};
std::vector<PlannedScan> PlanScans(const PlantWorld& world);

// What stands in the machine, part coordinates; built once, for its trees take longer than a scan.
class Stage {
 public:
  explicit Stage(const PlantWorld& world);
  // Sensor frame, mm, by the encoder's reading, whichever way it went: the form in which scans are sent.
  metrology::Points Read(const PlannedScan& scan, int threads) const;
  // With the sensor where it stands in a scan: swung, and behind its encoder.
  MachineTruth During(const PlannedScan& scan) const;

 private:
  Scene SceneOf(const PlannedScan& scan, const MachineTruth& truth) const;
  std::vector<std::shared_ptr<const Shape>> GhostsOf(const PlannedScan& scan) const;

  const PlantWorld& world_;
  std::shared_ptr<const Shape> finished_, casting_, neighbour_;
  std::vector<std::shared_ptr<const Shape>> pins_;
};

}  // namespace sixpoint::simulator
