#include "services/runtime/pages.h"

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

// Ties a token to its filters.
std::string MarkOf(const std::string& filters) { return storage::Sha256Hex(filters).substr(0, kMarkLength) + "-"; }

absl::Status NoTokenOfOurs(const std::string& page_token) {
  return Refuse("page_token", page_token.substr(0, 64), "the next_page_token of a page with the same filters");
}

struct PagePlace {
  std::string after;  // what the token says behind its mark; empty without a token
  int size = 0;
};

absl::StatusOr<PagePlace> PlaceOf(const std::string& filters, int page_size, const std::string& page_token) {
  if (page_size < 0) return Refuse("page_size", std::to_string(page_size), "0 to 1000");
  PagePlace place;
  place.size = page_size == 0 ? kUsualPageSize : std::min(page_size, kGreatestPageSize);
  if (page_token.empty()) return place;
  const std::string mark = MarkOf(filters);
  if (page_token.rfind(mark, 0) != 0 || page_token.size() == mark.size()) return NoTokenOfOurs(page_token);
  place.after = page_token.substr(mark.size());
  return place;
}

}  // namespace

absl::StatusOr<IdPage> IdPageOf(const std::string& filters, int page_size, const std::string& page_token) {
  const absl::StatusOr<PagePlace> place = PlaceOf(filters, page_size, page_token);
  if (!place.ok()) return place.status();
  if (!place->after.empty() && !CheckId("page_token", place->after).ok()) return NoTokenOfOurs(page_token);
  return IdPage{place->after, place->size};
}

absl::StatusOr<Page> PageOf(const std::string& filters, int page_size, const std::string& page_token) {
  const absl::StatusOr<PagePlace> place = PlaceOf(filters, page_size, page_token);
  if (!place.ok()) return place.status();
  Page page{0, place->size};
  if (page_token.empty()) return page;
  const char* const end = place->after.data() + place->after.size();
  const auto read = std::from_chars(place->after.data(), end, page.before_sequence);
  if (read.ec != std::errc() || read.ptr != end || page.before_sequence < 1) return NoTokenOfOurs(page_token);
  return page;
}

std::string TokenAfter(const std::string& filters, std::int64_t last_sequence) {
  return MarkOf(filters) + std::to_string(last_sequence);
}

std::string TokenAfterId(const std::string& filters, const std::string& last_id) { return MarkOf(filters) + last_id; }

}  // namespace sixpoint::runtime
