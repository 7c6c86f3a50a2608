// A ClearanceReader in memory: what stores in memory leave out for whom.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/clearances.h"

namespace sixpoint::testing {

class FakeClearances : public storage::ClearanceReader {
 public:
  std::map<std::string, std::string> customers;              // by part's id; of none: everybody's
  std::map<std::string, std::string> part_of;                // by name: a part's id, or empty
  std::set<std::pair<std::string, std::string>> clearances;  // identity and scope

  bool Hides(const storage::Reader& reader, const std::string& part_id) const {
    const auto of = customers.find(part_id);
    return !reader.sees_all && of != customers.end() && !IsCleared(reader, "parts/" + part_id) &&
           !IsCleared(reader, "customers/" + of->second);
  }
  bool IsCleared(const storage::Reader& reader, const std::string& scope) const {
    return reader.sees_all || clearances.count({reader.identity, scope}) > 0;
  }
  absl::StatusOr<std::optional<std::string>> FirstHidden(const storage::Reader& reader,
                                                         const std::vector<std::string>& names,
                                                         storage::Unrecorded unrecorded,
                                                         storage::Deadline) const override {
    if (std::none_of(customers.begin(), customers.end(), [&](const auto& part) { return Hides(reader, part.first); }))
      return std::nullopt;
    for (const std::string& name : names) {
      const auto known = part_of.find(name);
      const bool is_unrecorded = known == part_of.end();
      if (is_unrecorded ? unrecorded == storage::Unrecorded::kIsHidden : Hides(reader, known->second)) return name;
    }
    return std::nullopt;
  }
};

}  // namespace sixpoint::testing
