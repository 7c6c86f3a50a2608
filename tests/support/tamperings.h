// What a superuser of the database may do to the record, statement by statement, and what of it must be found. For a plant that
// AddTamperedPlant made.
#pragma once

#include <string>
#include <vector>

#include "ledger/head.h"
#include "storage/database.h"

namespace sixpoint::testing {

enum class Reseal {
  kNo,
  kYes,         // the whole ledger is made anew from the changed rows, without a head
  kAnotherKey,  // the same, and its head is signed by a key of the attacker's
};

struct Tampering {
  const char* what;
  const char* table;  // that must be named; "heads": only the heads that were sent out tell
  std::vector<std::string> sql;
  Reseal reseal = Reseal::kNo;
};
const std::vector<Tampering>& Tamperings();

// Blades SN-0, SN-1, ... with their results, a withdrawal, a gap in the sequence; sealed, with two heads, one before the last blade and one
// of all. Ends the program where it cannot.
std::vector<ledger::Head> AddTamperedPlant(storage::Database* database, const ledger::SigningKey& key, int blade_count);
// As a superuser: no trigger and no foreign key is in the way.
absl::Status Tamper(storage::Transaction& transaction, const Tampering& tampering);

}  // namespace sixpoint::testing
