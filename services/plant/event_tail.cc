#include "services/plant/event_tail.h"

#include <algorithm>
#include <utility>

#include "services/runtime/errors.h"

namespace sixpoint::plant {
namespace {

constexpr int kMostRead = 500;  // at once; what is left is read at once after it
constexpr std::chrono::seconds kTailPatience{2};

std::size_t SizeOf(const storage::EventRow& row) {
  const storage::RecordEntry& entry = row.entry.entry;
  std::size_t bytes = sizeof row + entry.name.size() + entry.summary_json.size() + entry.requested_by.size();
  for (const std::string& input : entry.inputs) bytes += sizeof input + input.size();
  if (row.parts)
    for (const std::string& part : *row.parts) bytes += sizeof part + part.size();
  return bytes;
}

absl::Status Away(const char* why) {
  return runtime::Failure(errors::v1::SERVICE_NOT_READY,
                          std::string("events: ") + why + "; call again with the last looked_at_sequence");
}

}  // namespace

EventTail::EventTail(std::shared_ptr<const storage::EventReader> journal, const EventTailOptions& options)
    : journal_(std::move(journal)), options_(options), thread_([this] { Run(); }) {}

EventTail::~EventTail() {
  Stop();
  thread_.join();
}

void EventTail::Stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
}

EventTail::Listener::Listener(EventTail* tail) : tail_(tail) {
  {
    const std::lock_guard<std::mutex> lock(tail_->mutex_);
    if (++tail_->listener_count_ == 1) tail_->answered_ = Clock::now();
  }
  tail_->changed_.notify_all();
}

EventTail::Listener::~Listener() {
  const std::lock_guard<std::mutex> lock(tail_->mutex_);
  --tail_->listener_count_;
}

absl::StatusOr<EventTail::After> EventTail::Wait(std::int64_t after_sequence, std::size_t most,
                                                 Clock::time_point until) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto has_more = [&] { return is_reading_ && upto_sequence_ > after_sequence; };
  changed_.wait_until(lock, until, [&] { return stopped_ || has_more(); });
  if (stopped_) return Away("the service stops");
  if (Clock::now() > answered_ + options_.patience) return Away("the database does not answer");
  // What the journal's end is, is not known yet.
  if (!is_reading_) return After{true, {}, after_sequence};
  if (after_sequence < from_sequence_) return After{};
  After after{true, {}, std::max(after_sequence, upto_sequence_)};
  const auto first = std::upper_bound(
      kept_.begin(), kept_.end(), after_sequence,
      [](std::int64_t sequence, const Kept& one) { return sequence < one.entry->entry.recorded.sequence; });
  for (auto one = first; one != kept_.end(); ++one) {
    after.entries.push_back(one->entry);
    if (after.entries.size() < most) continue;
    after.looked_at_sequence = one->entry->entry.recorded.sequence;
    break;
  }
  return after;
}

// What came past that number or, to begin with, where the journal ends.
absl::StatusOr<storage::EventPage> EventTail::Read(bool begins, std::int64_t after_sequence) const {
  const Clock::time_point deadline = Clock::now() + kTailPatience;
  if (!begins) return journal_->Events({{}, after_sequence, kMostRead, storage::Reader::Everything()}, deadline);
  const absl::StatusOr<storage::JournalNow> now = journal_->Now(deadline);
  if (!now.ok()) return now.status();
  return storage::EventPage{{}, now->newest_sequence, true};
}

void EventTail::Take(bool begins, storage::EventPage page) {
  if (begins) {
    kept_.clear();
    kept_bytes_ = 0;
    from_sequence_ = page.looked_at_sequence;
  }
  for (storage::EventRow& row : page.rows) {
    const std::size_t bytes = SizeOf(row);
    kept_.push_back({std::make_shared<const storage::EventRow>(std::move(row)), bytes, Clock::now()});
    kept_bytes_ += bytes;
  }
  upto_sequence_ = page.looked_at_sequence;
  is_reading_ = true;
  answered_ = Clock::now();
}

void EventTail::Forget() {
  const Clock::time_point now = Clock::now();
  while (!kept_.empty() &&
         (kept_bytes_ > options_.most_kept_bytes || now > kept_.front().read_at + options_.kept_for)) {
    from_sequence_ = kept_.front().entry->entry.recorded.sequence;
    kept_bytes_ -= kept_.front().bytes;
    kept_.pop_front();
  }
  if (kept_.empty()) from_sequence_ = upto_sequence_;
}

void EventTail::Run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopped_) {
    if (listener_count_ == 0) is_reading_ = false;
    changed_.wait(lock, [this] { return stopped_ || listener_count_ > 0; });
    if (stopped_) return;
    const bool begins = !is_reading_;
    const std::int64_t after_sequence = upto_sequence_;
    lock.unlock();
    absl::StatusOr<storage::EventPage> page = Read(begins, after_sequence);
    lock.lock();
    const bool has_more = page.ok() && !page->is_newest;
    if (page.ok()) {
      Take(begins, *std::move(page));
      Forget();
      if (begins || upto_sequence_ > after_sequence) changed_.notify_all();
    }
    if (!has_more) changed_.wait_for(lock, options_.every, [this] { return stopped_; });
  }
}

}  // namespace sixpoint::plant
