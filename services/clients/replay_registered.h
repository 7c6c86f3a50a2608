// Once more what rests on one recorded registration: a deviation map, a reconstruction.
#pragma once

#include <absl/status/statusor.h>

#include <utility>

#include "services/clients/blade_peers.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/replay.h"

namespace sixpoint::clients {

// Its registration is replayed first and is an input of the replay; again() computes the result from what it names, in a place of the pool.
template <typename Result, typename Again>
absl::StatusOr<replay::v1::Replay> ReplayRegistered(const absl::StatusOr<Result>& recorded, const BladePeers& peers,
                                                    const runtime::Caller& caller, runtime::ComputePool* running,
                                                    const Again& again) {
  if (!recorded.ok()) return recorded.status();
  const auto slot = running->Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return slot.status();
  auto registration = peers.registrations.Replay(recorded->registration(), caller.make_context());
  if (!registration.ok()) return registration.status();
  const absl::StatusOr<Result> now = again(*recorded);
  auto replay = runtime::ReplayOf(*recorded, now);
  if (replay.ok()) runtime::AddInput(*std::move(registration), &*replay);
  return replay;
}

}  // namespace sixpoint::clients
