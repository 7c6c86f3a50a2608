// Summaries of machines as messages.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/plant/fleet_alarms.h"
#include "sixpoint/plant/v1/fleet.pb.h"
#include "storage/fleet.h"

namespace sixpoint::plant {

// Of an upload's header; empty where the caller may not see it.
struct UploadNames {
  std::string machine_id, scan, subject;
};

// In the order of fleet.machine_ids. names: of fleet.uploads, in their order.
std::vector<v1::MachineState> StatesOf(const storage::FleetRows& fleet, const std::vector<UploadNames>& names);

// Hour by hour, of rows in their order.
std::vector<v1::ActivityHour> HoursOf(const std::vector<storage::ActivityRow>& rows);

// The time that so many of a step's took no longer: the middle of its bucket. counts: by bucket, at least one.
double QuantileOf(const std::map<int, std::int64_t>& counts, double share);

}  // namespace sixpoint::plant
