#include "services/runtime/sampler.h"

#include <utility>

namespace sixpoint::runtime {
namespace {

constexpr std::chrono::seconds kSamplePatience{2};
// Until the database is there.
constexpr std::chrono::milliseconds kSoonAgain{1000};

}  // namespace

Sampler::Sampler(storage::Database* database, std::vector<std::unique_ptr<Sampled>> sampled,
                 std::chrono::milliseconds every)
    : database_(database), sampled_(std::move(sampled)), every_(every) {
  if (!sampled_.empty()) thread_ = std::thread([this] { Run(); });
}

Sampler::~Sampler() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  stop_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Sampler::Run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopped_) {
    lock.unlock();
    bool all_read = true;
    for (const std::unique_ptr<Sampled>& each : sampled_) {
      absl::StatusOr<storage::Transaction> transaction =
          database_->Begin(std::chrono::steady_clock::now() + kSamplePatience);
      if (transaction.ok() && each->Read(*transaction).ok()) continue;
      each->Forget();
      all_read = false;
    }
    lock.lock();
    stop_.wait_for(lock, all_read ? every_ : std::min(every_, kSoonAgain), [this] { return stopped_; });
  }
}

}  // namespace sixpoint::runtime
