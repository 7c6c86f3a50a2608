#include "services/correction/result_pages.h"

#include <algorithm>
#include <charconv>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "storage/blobs.h"

namespace sixpoint::runtime {
namespace {

constexpr int kUsualPageSize = 100;
constexpr int kGreatestPageSize = 1000;
constexpr std::size_t kMarkLength = 12;

// Ties a token to its filter.
std::string MarkOf(const std::string& blade) { return storage::Sha256Hex("blade|" + blade).substr(0, kMarkLength); }

}  // namespace

absl::StatusOr<ResultPage> ResultPageOf(const std::string& blade, int page_size, const std::string& page_token) {
  ResultPage page;
  if (!blade.empty()) {
    const absl::StatusOr<std::string> serial = IdOf("blade", "blades", blade);
    if (!serial.ok()) return serial.status();
    page.blade_serial = *serial;
  }
  if (page_size < 0) return Refuse("page_size", std::to_string(page_size), "0 to 1000");
  page.size = page_size == 0 ? kUsualPageSize : std::min(page_size, kGreatestPageSize);
  if (page_token.empty()) return page;
  const std::string mark = MarkOf(blade) + "-";
  const char* const begin = page_token.data() + std::min(mark.size(), page_token.size());
  const char* const end = page_token.data() + page_token.size();
  const auto [stop, error] = std::from_chars(begin, end, page.before_sequence);
  if (page_token.rfind(mark, 0) != 0 || error != std::errc() || stop != end || page.before_sequence <= 0)
    return Refuse("page_token", page_token, "the next_page_token of a list of the same blade");
  return page;
}

std::string ResultTokenAfter(const std::string& blade, std::int64_t last_sequence) {
  return MarkOf(blade) + "-" + std::to_string(last_sequence);
}

}  // namespace sixpoint::runtime
