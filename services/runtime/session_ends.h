// When the sessions of an account ended, as every service keeps it in its memory: read anew each second (storage/session_ends.h), so
// that a sign-out or a change of an account counts everywhere within a second or two. Private to runtime.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "identity/session.h"
#include "storage/database.h"

namespace sixpoint::runtime {

// Thread-safe.
class SessionEnds {
 public:
  // One read of the database; what was read before stays where it fails.
  void Read(storage::Database* database, std::chrono::steady_clock::time_point deadline);
  // As read at that moment: by account (users/jane), the moment before which its sessions began that have ended.
  void Keep(std::map<std::string, storage::Instant> ended_before, std::chrono::steady_clock::time_point read_at);

  // UNAUTHENTICATED (SESSION_ENDED) of one that was ended; UNAVAILABLE (SERVICE_NOT_READY) where nothing was read for so long that
  // it is not known.
  absl::Status Check(const identity::Session& session, std::chrono::steady_clock::time_point now) const;

  static constexpr std::chrono::seconds kKnownFor{10};

 private:
  mutable std::mutex mutex_;
  std::map<std::string, storage::Instant> ended_before_;
  std::optional<std::chrono::steady_clock::time_point> read_at_;
};

}  // namespace sixpoint::runtime
