// What is checked of every request alike, before its handler: the bounds that the contract gives its fields, and the request_id of
// a call that changes something.
#pragma once

#include <absl/status/status.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

namespace sixpoint::runtime {

// INVALID_ARGUMENT with every field that holds more than its sixpoint.bounds.v1 options say (its size, never the text itself), and
// every text with a NUL byte in it, which no database takes. A field without such options is only as bounded as its message.
absl::Status CheckBounds(const google::protobuf::Message& request);

// Where a method changes something and its request has a request_id: a UUID, so that whoever repeats the call changes nothing
// twice.
absl::Status CheckRequestId(const google::protobuf::MethodDescriptor& method, const google::protobuf::Message& request);

}  // namespace sixpoint::runtime
