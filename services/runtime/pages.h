// Pages of a list (AIP-158): by the journal's sequence, or by id. Both are keysets: stable while rows are added. A token says where
// its page ended and holds for the request that it was given to, whatever its page_size.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_field.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace sixpoint::runtime {

// Newest first.
struct Page {
  std::int64_t before_sequence = 0;  // 0: from the newest
  int size = 0;
};
// By id.
struct IdPage {
  std::string after_id;  // empty: from the first
  int size = 0;
};

// filters: the request's filters in one text; a token made under others is refused, as is a negative size. More than 1000
// means 1000, none means 100.
absl::StatusOr<Page> PageOf(const std::string& filters, int page_size, const std::string& page_token);
absl::StatusOr<IdPage> IdPageOf(const std::string& filters, int page_size, const std::string& page_token);

// The token of the page that follows the row of that sequence or id, under the same filters.
std::string TokenAfter(const std::string& filters, std::int64_t last_sequence);
std::string TokenAfterId(const std::string& filters, const std::string& last_id);

// A page ends before it would have more, though not before its first message: clients of gRPC take 4 MiB unless told otherwise.
inline constexpr std::size_t kGreatestPageBytes = std::size_t{3} << 20;

// The first `size` of the rows, of which one more was read, as messages behind those in `out`. The page's last row where another page
// follows, which the token is made of; else null. to_proto(row) gives a message, or a StatusOr of one.
template <typename Row, typename Message, typename ToProto>
absl::StatusOr<const Row*> AddPage(const std::vector<Row>& rows, int size, const ToProto& to_proto,
                                   google::protobuf::RepeatedPtrField<Message>* out) {
  std::size_t page_bytes = 0;
  const Row* last = nullptr;
  for (const Row& row : rows) {
    if (&row - rows.data() == size) return last;
    absl::StatusOr<Message> message = to_proto(row);
    if (!message.ok()) return message.status();
    page_bytes += message->ByteSizeLong();
    if (last != nullptr && page_bytes > kGreatestPageBytes) return last;
    *out->Add() = *std::move(message);
    last = &row;
  }
  return nullptr;
}

// Everything that a request asks beside the page.
template <typename Request>
std::string FiltersOf(Request request) {
  request.clear_page_size();
  request.clear_page_token();
  return request.SerializeAsString();
}

}  // namespace sixpoint::runtime
