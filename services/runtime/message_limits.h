// How large a request of each method may be: the one table of it.
#pragma once

#include <google/protobuf/descriptor.h>

#include <cstddef>

namespace sixpoint::runtime {

// Of one message, where the method streams them.
std::size_t GreatestRequest_bytes(const google::protobuf::MethodDescriptor& method);

}  // namespace sixpoint::runtime
