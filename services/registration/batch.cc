#include "services/registration/batch.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "services/runtime/call.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/errors.h"
#include "services/runtime/memory_guard.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/retry.h"
#include "storage/requests.h"

namespace sixpoint::registration {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenProgress{200};
constexpr std::chrono::milliseconds kBetweenQuestions{50};
// Calls to other services end that much before the batch does: what they say then is not about their blade.
constexpr std::chrono::milliseconds kLastMoments{1000};

v1::RegistrationRefusal RefusalOf(const absl::Status& status) {
  // As Register's own refusal reads on the wire, INTERNAL without its text.
  const grpc::Status sent = runtime::ToGrpc(status);
  v1::RegistrationRefusal refusal;
  refusal.set_code(absl::StatusCodeToString(status.code()));
  refusal.set_reason(runtime::ReasonOf(status));
  refusal.set_message(sent.error_message());
  return refusal;
}

// One batch while it runs: workers register, the caller's thread sends.
class Run {
 public:
  Run(const v1::RegisterBatchRequest& batch, const Caller& caller, const RegisterOne& register_one,
      const BatchLimits& limits)
      : batch_(batch),
        caller_(caller),
        register_one_(register_one),
        limits_(limits),
        at_once_(static_cast<std::size_t>(limits.blades_at_once)),
        finished_count_(batch.skip_size()) {
    const std::vector<std::int32_t> skip(batch.skip().begin(), batch.skip().end());
    for (int i = 0; i < batch.requests_size(); ++i)
      if (std::find(skip.begin(), skip.end(), i) == skip.end()) open_.push_back(i);
  }

  absl::Status Go(const SendResponse& send) {
    std::vector<std::thread> workers;
    const std::size_t count = std::min(at_once_, open_.size());
    running_ = static_cast<int>(count);
    for (std::size_t i = 0; i < count; ++i)
      workers.emplace_back([this, call = runtime::CurrentCall()] {
        const runtime::CallScope scope(call);
        Work();
      });
    while (true) {
      std::vector<v1::RegisterBatchResponse> responses;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait_for(lock, kBetweenQuestions, [this] { return !finished_.empty() || running_ == 0; });
        responses = Take();
        if (responses.empty() && running_ == 0) break;
      }
      changed_.notify_all();
      for (const v1::RegisterBatchResponse& response : responses) {
        if (send(response)) continue;
        const std::lock_guard<std::mutex> lock(mutex_);
        client_gone_ = true;
      }
    }
    for (std::thread& worker : workers) worker.join();
    if (!ended_.ok()) return ended_;
    return finished_count_ == batch_.requests_size() && !client_gone_ ? absl::OkStatus() : Stopped();
  }

 private:
  bool KeepGoing() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (client_gone_ || !ended_.ok()) return false;
    }
    return Clock::now() < caller_.deadline && (!caller_.keep_going || caller_.keep_going());
  }

  absl::Status Stopped() const {
    return Clock::now() >= caller_.deadline - kLastMoments
               ? absl::DeadlineExceededError("batch: its time is over; call it again to go on")
               : absl::CancelledError("batch: the client went away; what was registered is kept");
  }

  // What there is to send now.
  std::vector<v1::RegisterBatchResponse> Take() {
    std::vector<v1::RegisterBatchResponse> responses;
    const auto add = [&]() -> v1::RegisterBatchResponse& {
      v1::RegisterBatchResponse& response = responses.emplace_back();
      response.set_total_count(batch_.requests_size());
      response.set_finished_count(finished_count_);
      return response;
    };
    for (auto& [index, progress] : progress_) *add().mutable_progress() = std::move(progress);
    progress_.clear();
    for (v1::FinishedRegistration& finished : finished_) {
      ++finished_count_;
      *add().mutable_finished() = std::move(finished);
    }
    finished_.clear();
    return responses;
  }

  void Work() {
    while (true) {
      int index = 0;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        // Results wait for a client that reads slowly, and so does the work.
        changed_.wait(lock, [this] { return finished_.size() < at_once_; });
        if (next_ == open_.size() || client_gone_ || !ended_.ok()) break;
        index = open_[next_++];
      }
      if (!KeepGoing()) break;
      v1::FinishedRegistration finished;
      finished.set_index(index);
      if (!Finish(index, &finished)) break;
      const std::lock_guard<std::mutex> lock(mutex_);
      progress_.erase(index);
      finished_.push_back(std::move(finished));
      changed_.notify_all();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    --running_;
    changed_.notify_all();
  }

  // False: the batch ends here.
  bool Finish(int index, v1::FinishedRegistration* finished) {
    Caller caller = caller_;
    // One alone is as Register: the batch's time is its own, and it waits no longer than others do.
    const bool alone = batch_.requests_size() == 1;
    if (!alone) caller.deadline = std::min<storage::Deadline>(caller_.deadline, Clock::now() + limits_.longest_one);
    caller.make_context = [this, deadline = caller.deadline] {
      std::unique_ptr<grpc::ClientContext> context = caller_.make_context();
      runtime::EndBy(deadline, context.get());
      return context;
    };
    caller.keep_going = [this, deadline = caller.deadline] { return Clock::now() < deadline && KeepGoing(); };
    if (!alone) caller.patience = runtime::ComputePool::Patience::kPatient;
    caller.on_progress = [this, index, sent_at = Clock::time_point(),
                          step = v1::REGISTRATION_STEP_UNSPECIFIED](const v1::RegistrationProgress& progress) mutable {
      if (progress.step() == step && Clock::now() < sent_at + kBetweenProgress) return;
      step = progress.step();
      sent_at = Clock::now();
      const std::lock_guard<std::mutex> lock(mutex_);
      v1::RegistrationProgress& latest = progress_[index] = progress;
      latest.set_index(index);
    };
    runtime::RetryLimits limits;
    limits.away_s = limits_.away_s;
    limits.full_s = limits_.full_s;
    limits.deadline = caller.deadline;
    runtime::Retry retry("batch", limits);
    const v1::RegisterRequest request = RequestAt(batch_, index);
    const auto register_it = [&] {
      return runtime::WithinMemory("registration: no memory left for it",
                                   [&] { return register_one_(request, caller); });
    };
    absl::StatusOr<v1::Registration> registration = register_it();
    while (KeepGoing() && retry.TryAgain(registration.status(), nullptr)) registration = register_it();
    if (registration.ok()) {
      *finished->mutable_registration() = *std::move(registration);
      return true;
    }
    const absl::Status& status = registration.status();
    if (!KeepGoing()) return false;
    const bool timely = absl::IsDeadlineExceeded(status) || absl::IsCancelled(status);
    if (timely && Clock::now() >= caller_.deadline - kLastMoments) return false;
    if (absl::IsUnavailable(status)) {
      const std::lock_guard<std::mutex> lock(mutex_);
      ended_ = status;
      return false;
    }
    *finished->mutable_refusal() = RefusalOf(status);
    return true;
  }

  const v1::RegisterBatchRequest& batch_;
  const Caller& caller_;
  const RegisterOne& register_one_;
  const BatchLimits limits_;
  const std::size_t at_once_;
  std::vector<int> open_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t next_ = 0;                              // of open_
  std::map<int, v1::RegistrationProgress> progress_;  // the latest of each, where it was not sent yet
  std::deque<v1::FinishedRegistration> finished_;     // not sent yet
  int finished_count_;
  int running_ = 0;
  bool client_gone_ = false;
  absl::Status ended_;
};

}  // namespace

absl::Status CheckBatch(const v1::RegisterBatchRequest& batch) {
  if (batch.requests_size() < 1) return runtime::Refuse("requests", "0 requests", "at least one");
  for (int i = 0; i < batch.requests_size(); ++i) {
    const std::string field = "requests[" + std::to_string(i) + "].";
    const v1::RegisterRequest& request = batch.requests(i);
    if (!request.request_id().empty())
      return runtime::Refuse(field + "request_id", request.request_id(), "empty; it follows from the batch's");
  }
  std::vector<bool> skipped(static_cast<std::size_t>(batch.requests_size()));
  for (int i = 0; i < batch.skip_size(); ++i) {
    const std::int32_t index = batch.skip(i);
    const std::string field = "skip[" + std::to_string(i) + "]";
    if (index < 0 || index >= batch.requests_size())
      return runtime::Refuse(field, std::to_string(index), "an index of requests");
    if (skipped[static_cast<std::size_t>(index)]) return runtime::Refuse(field, std::to_string(index), "each once");
    skipped[static_cast<std::size_t>(index)] = true;
  }
  return absl::OkStatus();
}

v1::RegisterRequest RequestAt(const v1::RegisterBatchRequest& batch, int index) {
  v1::RegisterRequest request = batch.requests(index);
  request.set_request_id(storage::UuidFrom(batch.request_id() + " " + std::to_string(index)));
  return request;
}

absl::Status RunBatch(const v1::RegisterBatchRequest& batch, const Caller& caller, const RegisterOne& register_one,
                      const SendResponse& send, const BatchLimits& limits) {
  if (absl::Status status = CheckBatch(batch); !status.ok()) return status;
  return Run(batch, caller, register_one, limits).Go(send);
}

}  // namespace sixpoint::registration
