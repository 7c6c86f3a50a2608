// A span of the database's clock, as a filter of lists.
#pragma once

#include <optional>

#include "storage/database.h"

namespace sixpoint::storage {

struct TimeSpan {
  std::optional<Instant> from;   // at this moment or later; none: from the first
  std::optional<Instant> until;  // before this moment; none: to the last
};

inline bool Contains(const TimeSpan& span, Instant at) {
  return (!span.from || at >= *span.from) && (!span.until || at < *span.until);
}

// The two ends as parameters, NULL where there is none: ($n::timestamptz IS NULL OR recorded_at >= $n).
inline void AddSpan(const TimeSpan& span, Params* params) {
  for (const std::optional<Instant>& end : {span.from, span.until}) end ? params->Time(*end) : params->Null();
}

}  // namespace sixpoint::storage
