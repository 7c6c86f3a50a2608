#include "services/runtime/call_gate.h"

#include <algorithm>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

// Less than a tenth of a core is for refusals; so many may come in one go.
constexpr double kRefusalsPerS = 500, kRefusalsAtOnce = 16;
constexpr std::chrono::milliseconds kBetweenQueueLooks{4};
// Where no room comes a connection is read again all the same, after so long a time and one at a time: what it brings is within what may be
// refused. Nobody is kept room for.
constexpr std::chrono::milliseconds kLongestPause{500}, kLongestPauseOfNobody{64}, kBetweenRefusedReads{32};
// By when a connection that is read again has brought the first of what waited in it, and then the rest.
constexpr std::chrono::milliseconds kTurn{400}, kRestOfTurn{50};
// Of a caller's places: for those of his calls that come on other connections while some bring nothing in their turn.
constexpr int kNeverKept = 8;

}  // namespace

CallGate::CallGate(CallLimits limits, OpenConnections* connections)
    : limits_(limits), connections_(connections), refusals_left_(kRefusalsAtOnce), thread_([this] { Run(); }) {}

CallGate::~CallGate() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

const grpc::Status& CallGate::Refusal() {
  static const auto* const refusal = new grpc::Status(
      ToGrpc(Failure(errors::v1::CALLS_FULL, "calls: as many are answered as may be, want fewer at once; try again")));
  return *refusal;
}

// Of places that are kept for connections whose turn it is; empty: all of them.
int CallGate::ReservedOf(const std::string& caller) const {
  int reserved = 0;
  const Clock::time_point now = Clock::now();
  for (const auto& [peer, turn] : turns_)
    if (now < turn.until && (caller.empty() || turn.caller == caller)) reserved += turn.calls_left;
  return reserved;
}

std::optional<CallGate::Place> CallGate::Enter(std::string caller, const grpc::ServerContextBase& context) {
  std::string peer = context.peer();
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto of_caller = of_caller_.emplace(caller, 0).first;
  // While connections wait for their turn, each has as many calls in a turn as it was given.
  const auto turn = turns_.find(peer);
  const bool is_its_turn = turn != turns_.end() && turn->second.caller == caller && Clock::now() < turn->second.until;
  const bool has_room = caller.empty() ? of_caller->second < limits_.of_nobody
                                       : of_caller->second + ReservedOf(caller) < limits_.per_caller;
  if (is_its_turn || (has_room && in_all_ + ReservedOf("") < limits_.at_once)) {
    if (is_its_turn) {
      // What waited was read at one go and is here; what comes now waits for the next turn.
      turn->second.until = std::min(turn->second.until, Clock::now() + kRestOfTurn);
      if (--turn->second.calls_left == 0) turns_.erase(turn);
      if (!paused_.empty()) Pause(std::move(peer), caller);
    }
    ++in_all_;
    ++of_caller->second;
    return Place(this, std::move(caller));
  }
  if (of_caller->second == 0) of_caller_.erase(of_caller);
  if (!MayRefuse() || !paused_.empty()) Pause(std::move(peer), caller);
  return std::nullopt;
}

void CallGate::Refused(const grpc::ServerContextBase& context) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!MayRefuse()) Pause(context.peer(), "");
}

void CallGate::Pause(std::string peer, const std::string& caller) {
  const bool is_paused =
      std::any_of(paused_.begin(), paused_.end(), [&](const Paused& one) { return one.peer == peer; });
  if (is_paused || !connections_->SetPaused(peer, true)) return;
  paused_.push_back({std::move(peer), caller, Clock::now()});
  changed_.notify_all();
}

void CallGate::Leave(const std::string& caller) {
  const std::lock_guard<std::mutex> lock(mutex_);
  --in_all_;
  const auto found = of_caller_.find(caller);
  if (--found->second == 0) of_caller_.erase(found);
}

bool CallGate::MayRefuse() {
  const Clock::time_point now = Clock::now();
  const double past_s = std::chrono::duration<double>(now - refusals_counted_).count();
  refusals_counted_ = now;
  refusals_left_ = std::min(kRefusalsAtOnce, refusals_left_ + past_s * kRefusalsPerS) - 1;
  refusals_left_ = std::max(refusals_left_, -kRefusalsAtOnce);
  return refusals_left_ >= 0;
}

void CallGate::Run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopped_) {
    changed_.wait(lock, [this] { return stopped_ || !paused_.empty(); });
    changed_.wait_for(lock, kBetweenQueueLooks, [this] { return stopped_; });
    ReadAgain();
  }
}

// Whether all that it may have waited with finds places.
bool CallGate::HasATurnFor(const Paused& one) const {
  if (one.caller.empty()) return false;
  const auto of_caller = of_caller_.find(one.caller);
  const int own = (of_caller == of_caller_.end() ? 0 : of_caller->second) + ReservedOf(one.caller);
  return own + limits_.per_connection + kNeverKept <= limits_.per_caller &&
         in_all_ + ReservedOf("") + limits_.per_connection <= limits_.at_once;
}

// Who waits longest first, of those some of whose calls would find places.
void CallGate::ReadAgain() {
  const Clock::time_point now = Clock::now();
  for (auto each = turns_.begin(); each != turns_.end();)
    each = now < each->second.until ? std::next(each) : turns_.erase(each);
  for (auto one = paused_.begin(); one != paused_.end();) {
    const bool its_turn = HasATurnFor(*one);
    const Clock::time_point longest = one->since + (one->caller.empty() ? kLongestPauseOfNobody : kLongestPause);
    if (!its_turn && !stopped_ && now < std::max(longest, read_for_refusal_ + kBetweenRefusedReads)) {
      ++one;
      continue;
    }
    if (its_turn)
      turns_[one->peer] = {one->caller, limits_.per_connection, now + kTurn};
    else
      read_for_refusal_ = now;
    connections_->SetPaused(one->peer, false);
    one = paused_.erase(one);
  }
}

}  // namespace sixpoint::runtime
