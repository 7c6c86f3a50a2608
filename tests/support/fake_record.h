// Kept requests and the journal in memory, as storage/requests.h and storage/record.h keep them: what the fake stores share.
// Each call of a store holds Lock() while it lasts.
#pragma once

#include <absl/status/statusor.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/record.h"
#include "storage/requests.h"
#include "storage/result_store.h"

namespace sixpoint::testing {

class FakeRecord {
 public:
  std::unique_lock<std::mutex> Lock() const { return std::unique_lock(mutex_); }
  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure) { failure_ = std::move(failure); }
  const absl::Status& failure() const { return failure_; }

  // What the request recorded before; find(name) gives the row of that name, or none.
  template <typename Row, typename Find>
  absl::StatusOr<std::optional<Row>> Kept(const storage::RecordedRequest& request, const Find& find) const {
    if (!failure_.ok()) return failure_;
    const auto kept = requests_.find({request.call, request.request_id});
    if (kept == requests_.end()) return std::nullopt;
    if (kept->second.bytes != request.bytes) return storage::RequestIdReused(request.request_id);
    return find(kept->second.name);
  }
  // That, or the work's row, which is kept under name_of(row). Work that fails stores nothing.
  template <typename Row, typename Find, typename Work, typename NameOf>
  absl::StatusOr<Row> Once(const storage::RecordedRequest& request, const Find& find, const Work& work,
                           const NameOf& name_of) {
    const absl::StatusOr<std::optional<Row>> kept = Kept<Row>(request, find);
    if (!kept.ok()) return kept.status();
    if (kept->has_value()) return **kept;
    const absl::StatusOr<Row> row = work();
    if (row.ok() && !request.request_id.empty())
      requests_[{request.call, request.request_id}] = {request.bytes, name_of(*row)};
    return row;
  }

  // What the next entry will be recorded as.
  storage::Recorded Next() const {
    return {static_cast<std::int64_t>(entries_.size()) + 1,
            std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now())};
  }
  void Append(storage::RecordEntry entry, const storage::Recorded& recorded) {
    entries_.push_back({std::move(entry), recorded});
  }
  const std::vector<storage::JournalEntry>& entries() const { return entries_; }

  // That an entry may have.
  static std::vector<std::string> Kinds() {
    return {"artefact",   "assessment",     "assignment",      "blade",          "calibration", "correction",
            "cut",        "deletion",       "deviation",       "disposition",    "drawing",     "fetch",
            "inspection", "machine",        "machining_model", "machining_pass", "measurement", "part",
            "policy",     "reconstruction", "refusal",         "registration",   "release",     "repair",
            "scan",       "section",        "study",           "withdrawal"};
  }

  // Whether a thing of that name is meant: itself or, of a name without @revision, one of its revisions.
  static bool Means(const std::string& name, const std::string& recorded) {
    return recorded == name || recorded.rfind(name + "@", 0) == 0;
  }
  // An empty name: everything. A span: of that what was recorded within it, and what was made from that.
  std::vector<storage::JournalEntry> DerivedFrom(const std::string& name, const storage::TimeSpan& span = {}) const {
    if (span.from || span.until) {
      std::vector<storage::JournalEntry> within;
      std::set<std::string> names;
      for (const storage::JournalEntry& entry : name.empty() ? entries_ : DerivedFrom(name))
        if (Contains(span, entry.recorded.recorded_at)) names.insert(entry.entry.name);
      for (const storage::JournalEntry& entry : entries_) {
        const std::vector<std::string>& inputs = entry.entry.inputs;
        if (std::any_of(inputs.begin(), inputs.end(), [&](const std::string& input) { return names.count(input) > 0; }))
          names.insert(entry.entry.name);
        if (names.count(entry.entry.name) > 0) within.push_back(entry);
      }
      return within;
    }
    std::vector<storage::JournalEntry> derived;
    std::set<std::string> names;
    for (const storage::JournalEntry& entry : entries_) {  // inputs are recorded before what is made of them
      const std::vector<std::string>& inputs = entry.entry.inputs;
      if (std::none_of(inputs.begin(), inputs.end(),
                       [&](const std::string& input) { return Means(name, input) || names.count(input) > 0; }))
        continue;
      names.insert(entry.entry.name);
      derived.push_back(entry);
    }
    return derived;
  }
  std::vector<storage::JournalEntry> MadeFrom(const std::string& name) const {
    std::set<std::string> names;
    std::vector<storage::JournalEntry> made_from;
    for (auto entry = entries_.rbegin(); entry != entries_.rend(); ++entry) {
      const bool is_meant = Means(name, entry->entry.name);
      const bool is_of_blade = "blades/" + entry->entry.blade.value_or("") == name;
      const bool is_input = names.count(entry->entry.name) > 0;
      if (is_meant || is_of_blade || is_input) names.insert(entry->entry.inputs.begin(), entry->entry.inputs.end());
      if ((is_of_blade || is_input) && entry->entry.name != name) made_from.insert(made_from.begin(), *entry);
    }
    return made_from;
  }

 private:
  mutable std::mutex mutex_;
  absl::Status failure_;
  std::vector<storage::JournalEntry> entries_;
  struct KeptName {
    std::string bytes, name;
  };
  std::map<std::pair<std::string, std::string>, KeptName> requests_;  // by call and id
};

}  // namespace sixpoint::testing
