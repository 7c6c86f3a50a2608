#include "tests/support/fake_events.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "tests/support/fake_record.h"

namespace sixpoint::testing {

void FakeEvents::Fail(absl::Status failure) {
  const std::lock_guard<std::mutex> lock(mutex_);
  failure_ = std::move(failure);
}

std::int64_t FakeEvents::Record(storage::EventRow row) {
  const std::lock_guard<std::mutex> lock(mutex_);
  row.entry.recorded = {static_cast<std::int64_t>(rows_.size()) + 1,
                        std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now())};
  row.is_restricted = !row.parts || std::any_of(row.parts->begin(), row.parts->end(), [&](const std::string& part) {
    return clearances.customers.count(part) > 0;
  });
  rows_.push_back(std::move(row));
  return rows_.back().entry.recorded.sequence;
}

std::int64_t FakeEvents::Record(const std::string& kind, const std::string& name) {
  storage::EventRow row;
  row.entry.entry.kind = kind;
  row.entry.entry.name = name;
  row.parts.emplace();
  return Record(std::move(row));
}

std::vector<std::string> FakeEvents::Hidden(const storage::Reader& reader) const {
  std::vector<std::string> hidden;
  for (const auto& [part, customer] : clearances.customers)
    if (clearances.Hides(reader, part)) hidden.push_back(part);
  return hidden;
}

absl::StatusOr<storage::EventPage> FakeEvents::Events(const storage::EventQuery& query, storage::Deadline) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!failure_.ok()) return failure_;
  const std::vector<std::string> hidden = Hidden(query.reader);
  const std::int64_t newest = static_cast<std::int64_t>(rows_.size());
  storage::EventPage page{{}, std::max(newest, query.after_sequence), true};
  for (const storage::EventRow& row : rows_) {
    if (row.entry.recorded.sequence <= query.after_sequence || !storage::LetsThrough(query.filter, row) ||
        !storage::IsSeen(row, hidden))
      continue;
    page.rows.push_back(row);
    if (static_cast<int>(page.rows.size()) < query.limit) continue;
    page.looked_at_sequence = row.entry.recorded.sequence;
    page.is_newest = page.looked_at_sequence == newest;
    break;
  }
  return page;
}

absl::StatusOr<storage::JournalNow> FakeEvents::Now(storage::Deadline) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!failure_.ok()) return failure_;
  return storage::JournalNow{static_cast<std::int64_t>(rows_.size()), FakeRecord::Kinds(), plant_id_};
}

absl::StatusOr<std::vector<std::string>> FakeEvents::HiddenParts(const storage::Reader& reader,
                                                                 storage::Deadline) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!failure_.ok()) return failure_;
  return Hidden(reader);
}

}  // namespace sixpoint::testing
