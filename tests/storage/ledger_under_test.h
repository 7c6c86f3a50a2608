// A ledger that a suite runs on, and what is recorded and done beside it: PostgreSQL's and the fake's.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "storage/ledger_store.h"
#include "tests/support/must.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {

class LedgerUnderTest {
 public:
  virtual ~LedgerUnderTest() = default;
  virtual LedgerStore& store() = 0;
  virtual void Record(const std::vector<std::string>& names, const std::string& blade = "") = 0;
  virtual void RecordInMarch(const std::string& name, const std::string& blade) = 0;
  virtual void DetachMarch() = 0;
  // Of an entry: its row of record_entries, of record_roots, one more of record_inputs, and its row of record_names.
  virtual void ChangeRow(const std::string& name) = 0;
  virtual void DropRow(const std::string& name) = 0;
  virtual void AddRow(const std::string& name) = 0;
  virtual void ChangeName(const std::string& name) = 0;
  virtual void DropName(const std::string& name) = 0;
  virtual void SwapNames(const std::string& one, const std::string& other) = 0;
  virtual void DropLeaf(std::int64_t index) = 0;
  virtual void SpoilNodes() = 0;
  virtual void MakeBlobsUnplain() = 0;
  virtual void PutBytes(const std::string& bytes) = 0;
  virtual void SpoilBytes(const std::string& sha256) = 0;
  // A surface that is named twice; its digest.
  virtual std::string NameLostSurface() = 0;

  std::int64_t SealAll() { return testing::Must(store().Seal(1000, testing::Soon())).count; }
  LedgerEnd End() { return testing::Must(store().End(testing::Soon())); }
  CheckedLeaves Checked(ledger::LeafSpan span) {
    return testing::Must(store().CheckLeaves(span, kBeforeAll, testing::Soon()));
  }
  std::vector<LedgerDamage> Damages() { return Checked({0, End().size}).slice.damages; }
  ProofPage Proof(const ProofQuery& query) { return testing::Must(store().ProofOfBlade(query, testing::Soon())); }
};

// Runs the test on each, with nothing recorded.
void OnBothLedgers(const std::function<void(LedgerUnderTest& ledger)>& test);

}  // namespace sixpoint::storage
