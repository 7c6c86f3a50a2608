// The rows of a blade as the services leave them, without the services: values that hold every constraint and mean nothing.
#pragma once

#include <string>

#include "storage/database.h"

namespace sixpoint::bench {

// What blades refer to: machine m1, artefact a1, part p1, calibrations of the sensor and of the axes.
struct Registry {
  std::string sensor_calibration_id, rotation_calibration_id;
};
// Ends the program where it cannot, as do the others.
Registry MakeRegistry(storage::Database* database);

struct BladeSize {
  int blocks_per_scan = 40, groups = 6, holes_per_group = 20;
};
// A blade's scan with its blocks, each a blob that is an object's (no bytes here).
void AddScan(storage::Transaction& transaction, const std::string& serial, const std::string& scan_id,
             int block_count = BladeSize().blocks_per_scan);
// A blade; four scans; a best fit and a six-point registration; a correction and an inspection of all its holes. Each in a transaction of
// its own, as the services do.
void AddBlade(storage::Database* database, const Registry& registry, const std::string& serial,
              const BladeSize& size = {});
// The blade alone.
void AddBladeOnly(storage::Database* database, const std::string& serial);

}  // namespace sixpoint::bench
