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

// A blade's scan with its 40 blocks, each a blob that is an object's (no bytes here).
void AddScan(storage::Transaction& transaction, const std::string& serial, const std::string& scan_id);
// A blade; four scans of 40 blocks; a best fit and a six-point registration; a correction and an inspection of 120 holes. Each in a
// transaction of its own, as the services do.
void AddBlade(storage::Database* database, const Registry& registry, const std::string& serial);
// The blade alone.
void AddBladeOnly(storage::Database* database, const std::string& serial);

}  // namespace sixpoint::bench
