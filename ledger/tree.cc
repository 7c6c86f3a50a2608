#include "ledger/tree.h"

#include <openssl/sha.h>

#include <algorithm>
#include <utility>

namespace sixpoint::ledger {
namespace {

// The greatest power of two below count; count > 1.
std::int64_t SplitOf(std::int64_t count) {
  std::int64_t split = 1;
  while (2 * split < count) split *= 2;
  return split;
}

int DigitOf(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

}  // namespace

Hash Sha256(std::string_view bytes) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest);
  return {reinterpret_cast<const char*>(digest), sizeof digest};
}

std::string HexOf(std::string_view bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  hex.reserve(2 * bytes.size());
  for (const unsigned char byte : bytes) {
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

std::string BytesOfHex(std::string_view hex) {
  std::string bytes;
  if (hex.size() % 2 != 0) return bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    const int high = DigitOf(hex[i]), low = DigitOf(hex[i + 1]);
    if (high < 0 || low < 0) return "";
    bytes += static_cast<char>(16 * high + low);
  }
  return bytes;
}

Hash EmptyRoot() { return Sha256(""); }

Hash LeafHash(std::string_view data) { return Sha256(std::string(1, '\0').append(data)); }

Hash NodeHash(std::string_view left, std::string_view right) {
  return Sha256(std::string(1, '\1').append(left).append(right));
}

void CompactRange::Append(Hash leaf, const OnNode& on_node) {
  Hash hash = std::move(leaf);
  int level = 0;
  for (std::int64_t rest = size_; rest % 2 == 1; rest /= 2) {
    hash = NodeHash(peaks_.back(), hash);
    peaks_.pop_back();
    ++level;
    if (on_node) on_node(level, size_ >> level, hash);
  }
  peaks_.push_back(std::move(hash));
  ++size_;
}

void CompactRange::AppendSubtree(int level, Hash hash) {
  for (std::int64_t rest = size_ >> level; rest % 2 == 1; rest /= 2) {
    hash = NodeHash(peaks_.back(), hash);
    peaks_.pop_back();
  }
  peaks_.push_back(std::move(hash));
  size_ += std::int64_t{1} << level;
}

Hash CompactRange::Root() const {
  if (peaks_.empty()) return EmptyRoot();
  Hash root = peaks_.back();
  for (auto peak = std::next(peaks_.rbegin()); peak != peaks_.rend(); ++peak) root = NodeHash(*peak, root);
  return root;
}

std::vector<LeafSpan> PathSpans(std::int64_t index, std::int64_t size) {
  std::vector<LeafSpan> spans;
  for (LeafSpan at{0, size}; at.end - at.begin > 1;) {
    const std::int64_t middle = at.begin + SplitOf(at.end - at.begin);
    const bool is_left = index < middle;
    spans.push_back(is_left ? LeafSpan{middle, at.end} : LeafSpan{at.begin, middle});
    at = is_left ? LeafSpan{at.begin, middle} : LeafSpan{middle, at.end};
  }
  std::reverse(spans.begin(), spans.end());
  return spans;
}

bool PathProves(const Hash& leaf, std::int64_t index, std::int64_t size, const std::vector<Hash>& path,
                const Hash& root) {
  if (index < 0 || index >= size) return false;
  std::int64_t at = index, last = size - 1;
  Hash hash = leaf;
  for (const Hash& beside : path) {
    if (last == 0) return false;
    if (at % 2 == 1 || at == last) {
      hash = NodeHash(beside, hash);
      while (at % 2 == 0 && at != 0) {
        at /= 2;
        last /= 2;
      }
    } else {
      hash = NodeHash(hash, beside);
    }
    at /= 2;
    last /= 2;
  }
  return last == 0 && hash == root;
}

}  // namespace sixpoint::ledger
