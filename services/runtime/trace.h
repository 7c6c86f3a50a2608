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
// The same of the span that it names.
std::string SpanIdOf(std::string_view traceparent);
// Of another span of the same trace, with the same flags; of a new trace where it is not well-formed.
std::string ChildOf(std::string_view traceparent);
// Whether who began the trace keeps its spans.
bool IsSampled(std::string_view traceparent);

}  // namespace sixpoint::runtime
