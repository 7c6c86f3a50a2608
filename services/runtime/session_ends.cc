#include "services/runtime/session_ends.h"

#include <utility>

#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "storage/one_read.h"
#include "storage/session_ends.h"

namespace sixpoint::runtime {

using std::chrono::steady_clock;

void SessionEnds::Read(storage::Database* database, steady_clock::time_point deadline) {
  const steady_clock::time_point begin = steady_clock::now();  // what ends after this may be missing
  absl::StatusOr<std::map<std::string, storage::Instant>> ends =
      storage::OneRead(*database, deadline, storage::RecentSessionEnds);
  if (ends.ok()) return Keep(*std::move(ends), begin);
  Log(LogLevel::kWarning, "the ends of sessions are not read: " + std::string(ends.status().message()));
}

void SessionEnds::Keep(std::map<std::string, storage::Instant> ended_before, steady_clock::time_point read_at) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ended_before_ = std::move(ended_before);
  read_at_ = read_at;
}

absl::Status SessionEnds::Check(const identity::Session& session, steady_clock::time_point now) const {
  const std::string account = session.person.Text();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!read_at_ || now - *read_at_ > kKnownFor)
    return Failure(errors::v1::SERVICE_NOT_READY,
                   "session: whether that of " + account + " was ended is not known, want the database to be there");
  const auto ended = ended_before_.find(account);
  if (ended == ended_before_.end() || session.since > ended->second) return absl::OkStatus();
  return Failure(errors::v1::SESSION_ENDED,
                 "session: of " + account + ", ended by a sign-out or a change of the account, want a new sign-in",
                 {{"resource", account}});
}

}  // namespace sixpoint::runtime
