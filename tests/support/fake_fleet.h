// A FleetReader in memory that tells what a test put into it. Held to the real one by tests/storage/fleet_reader_test.cc.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "storage/fleet.h"

namespace sixpoint::testing {

// To be changed while nobody reads.
class FakeFleet final : public storage::FleetReader {
 public:
  absl::Status failure;                                               // of every call
  storage::FleetRows rows;                                            // of all machines, whose ids are in order
  std::map<std::string, std::vector<storage::ActivityRow>> activity;  // by machine

  absl::StatusOr<storage::FleetRows> Fleet(const storage::FleetFilter& filter, storage::Deadline) const override {
    if (!failure.ok()) return failure;
    storage::FleetRows page = rows;
    const auto is_asked = [&](const std::string& id) {
      return id > filter.after && (filter.machine_id.empty() || id == filter.machine_id);
    };
    page.machine_ids.clear();
    for (const std::string& id : rows.machine_ids)
      if (is_asked(id) && static_cast<int>(page.machine_ids.size()) < filter.limit) page.machine_ids.push_back(id);
    const auto keep = [&](auto* of_machines) {
      of_machines->erase(std::remove_if(of_machines->begin(), of_machines->end(),
                                        [&](const auto& row) {
                                          return std::find(page.machine_ids.begin(), page.machine_ids.end(),
                                                           row.machine_id) == page.machine_ids.end();
                                        }),
                         of_machines->end());
    };
    keep(&page.activity);
    keep(&page.contacts);
    keep(&page.calibrations);
    keep(&page.work);
    keep(&page.damages);
    page.now = std::chrono::system_clock::now();
    return page;
  }
  absl::StatusOr<std::optional<std::vector<storage::ActivityRow>>> Activity(const std::string& machine_id,
                                                                            const storage::SummarySpan& span,
                                                                            storage::Deadline) const override {
    if (!failure.ok()) return failure;
    if (std::find(rows.machine_ids.begin(), rows.machine_ids.end(), machine_id) == rows.machine_ids.end())
      return std::nullopt;
    std::vector<storage::ActivityRow> within;
    const auto of_machine = activity.find(machine_id);
    if (of_machine != activity.end())
      for (const storage::ActivityRow& row : of_machine->second)
        if (row.begins_at >= span.from && row.begins_at < span.until) within.push_back(row);
    return within;
  }
};

}  // namespace sixpoint::testing
