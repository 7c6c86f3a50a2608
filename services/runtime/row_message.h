// How a service makes the message of a row.
#pragma once

#include <absl/status/statusor.h>

namespace sixpoint::runtime {

// Functions take these by the names below, which the compiler does not deduce: of overloaded ToProto and LeaveBasic the ones of this
// row and message are meant, whatever else a source includes.
template <typename Message, typename Row>
struct RowMessage {
  using Maker = absl::StatusOr<Message> (*)(const Row&);
  using Reducer = void (*)(Message*);  // takes from one what the BASIC view has not
};

}  // namespace sixpoint::runtime
