// When sessions of people were ended before their time (V0017): what every service reads again and again.
#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <optional>
#include <string>

#include "storage/database.h"

namespace sixpoint::storage {

// Of those that ended within the last half hour: by account (users/jane), the moment before which its sessions began. A token is older
// than that for nobody. RESOURCE_EXHAUSTED: more than 10000, of which some would be missing.
absl::StatusOr<std::map<std::string, Instant>> RecentSessionEnds(Transaction& transaction);
// Of one account, however long ago; none: never.
absl::StatusOr<std::optional<Instant>> SessionsEndedBefore(Transaction& transaction, const std::string& account);

// When a session begins that is given now: after all that ended, also where the database's clock was set back since. Kept with the
// account, which is locked and there.
struct SessionStart {
  Instant since, now;
};
absl::StatusOr<SessionStart> BeginSession(Transaction& transaction, const std::string& account);
// None of its sessions counts any more, also of those that began when the database's clock was ahead. The account is locked.
absl::Status EndSessions(Transaction& transaction, const std::string& account);

}  // namespace sixpoint::storage
