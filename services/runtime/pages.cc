#include "services/runtime/pages.h"

#include <algorithm>
#include <charconv>

#include "services/runtime/errors.h"
#include "storage/blobs.h"

namespace sixpoint::runtime {
namespace {

constexpr int kUsualPageSize = 100;
constexpr int kGreatestPageSize = 1000;
constexpr std::size_t kMarkLength = 12;

// Ties a token to its filters.
std::string MarkOf(const std::string& filters) { return storage::Sha256Hex(filters).substr(0, kMarkLength) + "-"; }

}  // namespace

absl::StatusOr<Page> PageOf(const std::string& filters, int page_size, const std::string& page_token) {
  if (page_size < 0) return Refuse("page_size", std::to_string(page_size), "0 to 1000");
  Page page;
  page.size = page_size == 0 ? kUsualPageSize : std::min(page_size, kGreatestPageSize);
  if (page_token.empty()) return page;
  const std::string mark = MarkOf(filters);
  const bool ours = page_token.rfind(mark, 0) == 0;
  const char* const end = page_token.data() + page_token.size();
  const auto read = std::from_chars(page_token.data() + (ours ? mark.size() : 0), end, page.before_sequence);
  if (!ours || read.ec != std::errc() || read.ptr != end || page.before_sequence < 1)
    return Refuse("page_token", page_token.substr(0, 64), "the next_page_token of a page with the same filters");
  return page;
}

std::string TokenAfter(const std::string& filters, std::int64_t last_sequence) {
  return MarkOf(filters) + std::to_string(last_sequence);
}

}  // namespace sixpoint::runtime
