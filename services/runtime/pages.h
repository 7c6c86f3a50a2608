// Pages of a list, newest first, by the journal's sequence (keyset: stable while rows are added). AIP-158.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

namespace sixpoint::runtime {

struct Page {
  std::int64_t before_sequence = 0;  // 0: from the newest
  int size = 0;
};

// filters: the request's filters in one text; a token made under others is refused, as is a negative size. More than 1000
// means 1000, none means 100.
absl::StatusOr<Page> PageOf(const std::string& filters, int page_size, const std::string& page_token);

// The token of the page that follows the row of that sequence, under the same filters.
std::string TokenAfter(const std::string& filters, std::int64_t last_sequence);

}  // namespace sixpoint::runtime
