// What requests for lists share: the view and the time range (sixpoint.list.v1).
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/list/v1/list.pb.h"
#include "storage/time_span.h"

namespace sixpoint::runtime {

// A whole resource may be a megabyte.
inline constexpr int kGreatestFullPageSize = 50;

// Whether the whole resources are wanted; refuses a view that is none.
absl::StatusOr<bool> WantsFull(list::v1::View view);

// Refuses moments outside the years 2000 to 2199, and a range that ends before it begins.
absl::StatusOr<storage::TimeSpan> SpanOf(const std::string& field, const list::v1::TimeRange& range);

}  // namespace sixpoint::runtime
