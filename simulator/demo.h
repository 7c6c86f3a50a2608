// The plant's main job, shown and checked: several machines at once, each through a whole blade.
#pragma once

#include <cstdint>
#include <string>

namespace sixpoint::simulator {

struct DemoOptions {
  std::string server = "127.0.0.1:7400";
  std::string identity;  // folder of the certificate by which the plant knows its machines and who registers them
  int machines = 2;
  std::uint64_t seed = 1;
  bool line_rate = false;  // send 300 profiles a second, as the scanner measures, instead of as fast as possible
  double airfoil_pitch_mm = 0.2;
  double pins_pitch_mm = 0.1;
  bool by_plan = false;       // blades are scanned by the plant's measuring plans
  std::string station;        // of a fixture, at which blades are clamped; empty: they stand alone
  double casting_mm = 0;      // castings are held to the pose alone
  std::string report_file;    // JSON; none when empty
  bool keep_working = false;  // afterwards, until a signal ends it (living_fleet.h)
  double pace_s = 90;         // of that: between two blades of one machine
};

// Limits that the demo holds the plant to, against the simulator's truth.
inline constexpr double kPoseLimit_um = 10;
inline constexpr double kHoleLimit_um = 15;

// Prints progress and, at the end, a table. 0 only if every machine went the whole way, every hole was measured, and
// pose and hole errors agree with the truth within the limits.
int RunDemo(const DemoOptions& options);

}  // namespace sixpoint::simulator
