#include "services/plant/event_filter.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::plant {
namespace {

std::string Joined(const std::vector<std::string>& texts) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : ", ") + text;
  return joined;
}

}  // namespace

absl::StatusOr<storage::EventFilter> EventFilterOf(const v1::EventFilter& given, const storage::JournalNow& now) {
  storage::EventFilter filter;
  runtime::Refusals refusals;
  for (const auto& [field, collection, name, id] :
       {std::tuple("filter.machine", "machines", &given.machine(), &filter.machine_id),
        std::tuple("filter.blade", "blades", &given.blade(), &filter.blade_serial),
        std::tuple("filter.part", "parts", &given.part(), &filter.part_id)}) {
    absl::StatusOr<std::string> read = runtime::FilterIdOf(field, collection, *name);
    refusals.Add(read.status());
    if (read.ok()) *id = *std::move(read);
  }
  for (int i = 0; i < given.kinds_size(); ++i) {
    if (std::find(now.kinds.begin(), now.kinds.end(), given.kinds(i)) == now.kinds.end())
      refusals.Add(
          runtime::Refuse("filter.kinds[" + std::to_string(i) + "]", given.kinds(i), "one of " + Joined(now.kinds)));
    filter.kinds.push_back(given.kinds(i));
  }
  for (int i = 0; i < given.verdicts_size(); ++i) {
    const std::string& verdict = given.verdicts(i);
    if (verdict.empty() || verdict.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_") != std::string::npos)
      refusals.Add(runtime::Refuse("filter.verdicts[" + std::to_string(i) + "]", verdict,
                                   "a verdict as entries have it: CONFORM, NOT_CONFORM, UNDECIDABLE, ..."));
    filter.verdicts.push_back(verdict);
  }
  if (!refusals.status().ok()) return refusals.status();
  return filter;
}

absl::Status CheckAfterSequence(std::int64_t after_sequence, const storage::JournalNow& now) {
  if (after_sequence >= 0 && after_sequence <= now.newest_sequence) return absl::OkStatus();
  return runtime::Refuse("after_sequence", std::to_string(after_sequence),
                         "0 to " + std::to_string(now.newest_sequence) + ", the newest entry of this plant's journal");
}

}  // namespace sixpoint::plant
