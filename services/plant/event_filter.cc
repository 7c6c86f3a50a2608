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

absl::Status CheckKinds(const std::string& field, const google::protobuf::RepeatedPtrField<std::string>& kinds,
                        const std::vector<std::string>& known) {
  runtime::Refusals refusals;
  for (int i = 0; i < kinds.size(); ++i)
    if (std::find(known.begin(), known.end(), kinds[i]) == known.end())
      refusals.Add(runtime::Refuse(field + "[" + std::to_string(i) + "]", kinds[i], "one of " + Joined(known)));
  return refusals.status();
}

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
  refusals.Add(CheckKinds("filter.kinds", given.kinds(), now.kinds));
  filter.kinds.assign(given.kinds().begin(), given.kinds().end());
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
