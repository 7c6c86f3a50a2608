// A leaf of the ledger: one entry of the journal, as the text whose hash is in the tree.
#pragma once

#include <cstdint>
#include <string>

#include "ledger/tree.h"

namespace sixpoint::ledger {

struct Leaf {
  std::int64_t index = 0;
  std::int64_t record_sequence = 0;
  std::string record_id;
  int format = 0;
  Hash name_sha256;     // of the text of its row of record_names
  Hash content_sha256;  // of the text that says its tables, how many rows of each, and their digest
};

inline std::string LeafText(const Leaf& leaf) {
  return "sixpoint-ledger-leaf-" + std::to_string(leaf.format) + "\n" + std::to_string(leaf.record_sequence) + "\n" +
         leaf.record_id + "\n" + HexOf(leaf.name_sha256) + "\n" + HexOf(leaf.content_sha256) + "\n";
}

}  // namespace sixpoint::ledger
