// Credentials on their way from the plant's authority to where they are used: the first by a one-time code, what follows as
// certificates of the same key. The plant keeps both until they are asked for (sixpoint/plant/v1/credentials.proto).
#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli/session.h"
#include "identity/authority.h"
#include "identity/credentials.h"

namespace sixpoint::cli {

// Seals them, has the plant keep them for so long, and prints the code, which is known nowhere else.
absl::Status OfferCredentials(Session* session, const identity::Identity& whose,
                              const identity::Credentials& credentials, int valid_hours);
// On the machine that they are for: the code is used up by it. `folder` holds no identity.pem yet.
absl::Status TakeCredentials(Session* session, const std::string& code, const std::filesystem::path& folder);

// Has the plant keep a certificate for the holder of its key.
absl::Status OfferRenewal(Session* session, const std::string& certificate_pem);
// By the holder: puts the certificate that waits for it in the place of its own.
absl::Status FetchRenewal(Session* session);

// What lies with others, of machines and of the users that are named: `due` has less than half of its time left and is to be followed
// by another of its key; `to_offer` has followed one and may still wait to be fetched. Of each key the one that lasts longest; what was
// revoked or is over counts for nothing.
struct HandedOver {
  std::vector<identity::IssuedCertificate> due, to_offer;
};
HandedOver HandOver(const std::vector<identity::IssuedCertificate>& issued, const std::vector<std::string>& users,
                    identity::TimePoint now);

}  // namespace sixpoint::cli
