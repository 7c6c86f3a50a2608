#include "services/runtime/list_filters.h"

#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::runtime {
absl::StatusOr<bool> WantsFull(list::v1::View view) {
  if (!list::v1::View_IsValid(view)) return Refuse("view", std::to_string(view), "VIEW_BASIC or VIEW_FULL");
  return view == list::v1::VIEW_FULL;
}

absl::StatusOr<storage::TimeSpan> SpanOf(const std::string& field, const list::v1::TimeRange& range) {
  storage::TimeSpan span;
  if (range.has_from()) {
    if (absl::Status status = CheckMoment(field + ".from", range.from()); !status.ok()) return status;
    span.from = MomentOf(range.from());
  }
  if (range.has_until()) {
    if (absl::Status status = CheckMoment(field + ".until", range.until()); !status.ok()) return status;
    span.until = MomentOf(range.until());
  }
  if (span.from && span.until && *span.until < *span.from)
    return Refuse(field + ".until", std::to_string(range.until().seconds()) + " s", "not before " + field + ".from");
  return span;
}

}  // namespace sixpoint::runtime
