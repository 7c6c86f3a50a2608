// W3C trace context: the traceparent header that ties one request's lines in all services' logs together.
#pragma once

#include <string>
#include <string_view>

namespace sixpoint::runtime {

inline constexpr char kTraceparent[] = "traceparent";

// "00-<32 hexadecimal>-<16 hexadecimal>-01" of a new trace.
std::string NewTraceparent();
// The trace id of a well-formed traceparent; empty for any other text.
std::string TraceIdOf(std::string_view traceparent);

}  // namespace sixpoint::runtime
