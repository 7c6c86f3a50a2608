// A certificate as people and programs read it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/table.h"
#include "identity/authority.h"

namespace sixpoint::cli {

// Soon is within 30 days, or within the last third of its time where that is less: one for a month is not always about to end.
enum class CertificateState { kValid, kExpiresSoon, kExpired, kRevoked };
CertificateState StateOf(const identity::IssuedCertificate& certificate, identity::TimePoint now);
// "valid", "expires soon", "expired", "revoked".
std::string StateText(const identity::IssuedCertificate& certificate);

nlohmann::json CertificateToJson(const identity::IssuedCertificate& certificate);
Table CertificateTable();
Cells CertificateCells(const identity::IssuedCertificate& certificate);

}  // namespace sixpoint::cli
