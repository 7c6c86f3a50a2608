// The ledger as a superuser meets it: each kind of tampering committed on a copy of a plant, and looked for by the service; and what a check
// costs beside reading the same rows by plain SQL.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace sixpoint::bench {

// On a fresh database, which is filled. {kinds: [{what, found}], false_alarms}
nlohmann::json TamperWithAll(const std::string& conninfo);
// On a filled database. {entries, seal_s, verify_s, sql_s}
nlohmann::json SealAndVerify(const std::string& conninfo);

}  // namespace sixpoint::bench
