// What a replay answers: a recorded result beside what came out of computing it once more.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/message.h>

#include "sixpoint/replay/v1/replay.pb.h"

namespace sixpoint::runtime {

// recorded, now: the result's message, as it is stored and as it came out now. Name, who asked, when, version, computer and which older
// one it judges anew are not figures of the result.
replay::v1::Replay CompareReplay(const google::protobuf::Message& recorded, const google::protobuf::Message& now);

// Where it could not be computed: bytes that are damaged or gone, or a refusal of what was not refused then, make an answer of their own.
// Any other failure (a service that is away, a call that was ended) is not of the result, and is given back.
absl::StatusOr<replay::v1::Replay> FailedReplay(const google::protobuf::Message& recorded, const absl::Status& failure);

// The one or the other.
template <typename Result>
absl::StatusOr<replay::v1::Replay> ReplayOf(const Result& recorded, const absl::StatusOr<Result>& now) {
  if (!now.ok()) return FailedReplay(recorded, now.status());
  return CompareReplay(recorded, *now);
}

// With those that it rests on: it is only as good as they are.
void AddInput(replay::v1::Replay input, replay::v1::Replay* replay);

}  // namespace sixpoint::runtime
