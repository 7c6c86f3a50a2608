// What a replay answers: a recorded result beside what came out of computing it once more.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/message.h>

#include <string>
#include <vector>

#include "sixpoint/replay/v1/replay.pb.h"

namespace sixpoint::runtime {

// recorded, now: the result's message, as it is stored and as it came out now. taken_as_recorded: paths of its fields that were not
// computed again. Name, who asked, when, version, computer and which older one it judges anew are not figures of the result.
replay::v1::Replay CompareReplay(const google::protobuf::Message& recorded, const google::protobuf::Message& now,
                                 const std::vector<std::string>& taken_as_recorded = {});

// Where it could not be computed: bytes that are damaged or gone, or a refusal of what was not refused then, make an answer of their own.
// Any other failure (a service that is away, a call that was ended) is not of the result, and is given back.
absl::StatusOr<replay::v1::Replay> FailedReplay(const google::protobuf::Message& recorded, const absl::Status& failure);

// With those that it rests on: it is only as good as they are.
void AddInput(replay::v1::Replay input, replay::v1::Replay* replay);

}  // namespace sixpoint::runtime
