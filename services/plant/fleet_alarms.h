// What of a machine wants somebody's attention: from what is known of it, by fixed bounds, which the contract tells (plant/v1/fleet.proto).
#pragma once

#include <string>
#include <vector>

#include "sixpoint/plant/v1/fleet.pb.h"
#include "storage/fleet.h"

namespace sixpoint::plant {

// Of one machine.
struct MachineRows {
  std::vector<const storage::ContactRow*> contacts;  // newest first
  std::vector<const storage::MachineCalibrationRow*> calibrations;
  std::vector<const storage::UploadInProgressRow*> uploads;
  const storage::MachineWorkRow* work = nullptr;       // null: no blade is in work
  const storage::MachineDamageRow* damages = nullptr;  // null: none are known
};

// When the machine itself was last heard of: the newest scan, fetch, cut or block; null and an empty name: never.
struct HeardOf {
  const storage::ContactRow* contact = nullptr;
  const storage::UploadInProgressRow* upload = nullptr;  // set where it is newer
};
HeardOf LastHeardOf(const MachineRows& machine);

// The most urgent first. state: with its yield.
std::vector<v1::MachineAlarm> AlarmsOf(const MachineRows& machine, const v1::MachineState& state, storage::Instant now);

}  // namespace sixpoint::plant
