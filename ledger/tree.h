// The Merkle tree of RFC 9162 (the same as RFC 6962's): leaves in order, one root, and for each leaf a path of O(log n) hashes that
// proves it. Pure; a hash is 32 bytes.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace sixpoint::ledger {

using Hash = std::string;

Hash Sha256(std::string_view bytes);
std::string HexOf(std::string_view bytes);  // lower case
// Empty of what is no hexadecimal text of whole bytes.
std::string BytesOfHex(std::string_view hex);

Hash EmptyRoot();
Hash LeafHash(std::string_view data);                          // SHA-256(0x00 || data)
Hash NodeHash(std::string_view left, std::string_view right);  // SHA-256(0x01 || left || right)

// Of the first `size` leaves all that further leaves need: the roots of its perfect subtrees, the greatest first.
class CompactRange {
 public:
  // Told of each perfect subtree that becomes complete: of 2^level leaves, the index-th of them.
  using OnNode = std::function<void(int level, std::int64_t index, const Hash& hash)>;

  void Append(Hash leaf, const OnNode& on_node = nullptr);
  // A perfect subtree of 2^level leaves; the size is a multiple of that.
  void AppendSubtree(int level, Hash hash);
  std::int64_t size() const { return size_; }
  Hash Root() const;

 private:
  std::int64_t size_ = 0;
  std::vector<Hash> peaks_;
};

// Leaves [begin, end).
struct LeafSpan {
  std::int64_t begin = 0, end = 0;
};
// The subtrees whose roots are the path of leaf `index` in a tree of `size` leaves, the leaf's sibling first; index < size.
std::vector<LeafSpan> PathSpans(std::int64_t index, std::int64_t size);
// RFC 9162, 2.1.3.2.
bool PathProves(const Hash& leaf, std::int64_t index, std::int64_t size, const std::vector<Hash>& path,
                const Hash& root);

}  // namespace sixpoint::ledger
