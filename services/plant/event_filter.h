// What a request may ask of events: for those who watch, those who ask, and those whom they are sent to.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "sixpoint/plant/v1/event.pb.h"
#include "storage/events.h"

namespace sixpoint::plant {

// Refuses each that no entry can have: nothing would be found, and look like nothing being there. field: kinds, filter.kinds.
absl::Status CheckKinds(const std::string& field, const google::protobuf::RepeatedPtrField<std::string>& kinds,
                        const std::vector<std::string>& known);
// Refuses each field that names nothing, with what was wanted.
absl::StatusOr<storage::EventFilter> EventFilterOf(const v1::EventFilter& given, const storage::JournalNow& now);
// Refuses a number past the newest entry: of another journal, or of an older state of this one that was restored.
absl::Status CheckAfterSequence(std::int64_t after_sequence, const storage::JournalNow& now);

}  // namespace sixpoint::plant
