// Pages of a list of results filtered by blade, newest first, by the journal's sequence (keyset: stable while rows are
// added).
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

namespace sixpoint::runtime {

struct ResultPage {
  std::string blade_serial;          // empty: all
  std::int64_t before_sequence = 0;  // 0: from the newest
  int size = 0;
};

// blade: blades/{serial} or empty. Refuses a bad blade, a negative size, and a token that was not made for this blade.
// More than 1000 means 1000, none means 100.
absl::StatusOr<ResultPage> ResultPageOf(const std::string& blade, int page_size, const std::string& page_token);

std::string ResultTokenAfter(const std::string& blade, std::int64_t last_sequence);

}  // namespace sixpoint::runtime
