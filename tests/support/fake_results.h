// A ResultStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/result_store_test.cc.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/result_store.h"

namespace sixpoint::testing {

template <typename Row, typename Filter>
class FakeResults final : public storage::ResultStore<Row, Filter> {
 public:
  // id: the row's member; matches(row, filter): whether a list under that filter holds the row.
  FakeResults(std::string Row::*id, std::function<bool(const Row&, const Filter&)> matches)
      : id_(id), matches_(std::move(matches)) {}

  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure) {
    const std::lock_guard lock(mutex_);
    failure_ = std::move(failure);
  }
  std::vector<Row> rows() const {
    const std::lock_guard lock(mutex_);
    return rows_;
  }
  std::vector<storage::RecordEntry> entries() const {
    const std::lock_guard lock(mutex_);
    return entries_;
  }

  absl::StatusOr<std::optional<std::string>> FindAnswer(const storage::RecordedRequest& request,
                                                        storage::Deadline) const override {
    const std::lock_guard lock(mutex_);
    return Kept(request);
  }
  absl::StatusOr<std::optional<Row>> Find(const std::string& id, storage::Deadline) const override {
    const std::lock_guard lock(mutex_);
    if (!failure_.ok()) return failure_;
    for (const Row& row : rows_)
      if (row.*id_ == id) return row;
    return std::nullopt;
  }
  absl::StatusOr<std::vector<Row>> List(const Filter& filter, std::int64_t before_sequence, int limit,
                                        storage::Deadline) const override {
    const std::lock_guard lock(mutex_);
    if (!failure_.ok()) return failure_;
    std::vector<Row> listed;
    for (auto row = rows_.rbegin(); row != rows_.rend() && static_cast<int>(listed.size()) < limit; ++row)
      if ((before_sequence == 0 || row->recorded.sequence < before_sequence) && matches_(*row, filter))
        listed.push_back(*row);
    return listed;
  }
  absl::StatusOr<std::string> Record(const storage::RecordedRequest& request, Row row,
                                     const storage::RecordEntry& entry, const storage::AnswerOf<Row>& answer_of,
                                     storage::Deadline) override {
    const std::lock_guard lock(mutex_);
    absl::StatusOr<std::optional<std::string>> kept = Kept(request);
    if (!kept.ok()) return kept.status();
    if (kept->has_value()) return **std::move(kept);
    row.recorded.sequence = static_cast<std::int64_t>(rows_.size()) + 1;
    row.recorded.recorded_at = std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
    absl::StatusOr<std::string> answer = answer_of(row);
    if (!answer.ok()) return answer;
    rows_.push_back(std::move(row));
    entries_.push_back(entry);
    if (!request.request_id.empty()) answers_[{request.call, request.request_id}] = {request.bytes, *answer};
    return answer;
  }

 private:
  absl::StatusOr<std::optional<std::string>> Kept(const storage::RecordedRequest& request) const {
    if (!failure_.ok()) return failure_;
    const auto kept = answers_.find({request.call, request.request_id});
    if (kept == answers_.end()) return std::nullopt;
    if (kept->second.first != request.bytes)
      return absl::AlreadyExistsError("request_id: " + request.request_id + " was used for another request");
    return kept->second.second;
  }

  std::string Row::*const id_;
  const std::function<bool(const Row&, const Filter&)> matches_;
  mutable std::mutex mutex_;
  absl::Status failure_;
  std::vector<Row> rows_;  // as recorded
  std::vector<storage::RecordEntry> entries_;
  std::map<std::pair<std::string, std::string>, std::pair<std::string, std::string>> answers_;
};

}  // namespace sixpoint::testing
