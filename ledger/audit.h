// Whether the leaves that a plant shows are those that it signed for: the roots computed again, and compared with every head that is
// known, above all with those that left the plant.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ledger/head.h"
#include "ledger/tree.h"

namespace sixpoint::ledger {

enum class FindingKind {
  kRewritten,     // leaves are not those of a head
  kCutOff,        // there are fewer leaves than a head covers
  kNotSigned,     // a head's signature does not hold by the key
  kAnotherPlant,  // heads are of two plants
  kNoHead,        // a key was given, there are leaves, and no head that it could have signed
};
struct Finding {
  FindingKind kind;
  std::string sentence;
};

// Leaves in order, slice by slice; then Finish.
class Audit {
 public:
  // sent: heads that left the plant; public_pem: the key, from elsewhere; empty: no signature is looked at.
  Audit(std::vector<Head> sent, std::string public_pem);
  // Heads that the plant itself shows; before the leaves up to their size.
  void AddHead(const Head& head);
  void AddLeaves(const std::vector<Hash>& leaves);
  void Finish();

  const std::vector<Finding>& findings() const { return findings_; }
  std::int64_t size() const { return range_.size(); }
  Hash Root() const { return range_.Root(); }
  std::int64_t heads_checked() const { return heads_checked_; }
  // Of the greatest head that agrees; its size 0: none.
  const Head& last_good() const { return last_good_; }

 private:
  void CheckSignature(const Head& head, const char* whose);
  void Compare(const Head& head);

  std::vector<Head> sent_;   // by size
  std::vector<Head> shown_;  // of sizes that are not reached yet
  const std::string public_pem_;
  std::string plant_id_;
  std::size_t next_sent_ = 0;
  CompactRange range_;
  std::vector<Finding> findings_;
  std::int64_t heads_checked_ = 0, rewritten_count_ = 0;
  Head last_good_;
};

}  // namespace sixpoint::ledger
