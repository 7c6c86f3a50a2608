// An id or a request_id that has its form and means nothing else.
#pragma once

namespace sixpoint::testing {

inline constexpr char kSomeUuid[] = "018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e";

}  // namespace sixpoint::testing
