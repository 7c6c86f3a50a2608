// How long texts and lists from outside may be, the same in every service. The database checks the texts again
// (tests/storage/migrate_test.cc).
#pragma once

#include <absl/status/status.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <cstddef>
#include <string>

namespace sixpoint::runtime {

inline constexpr int kMostScans = 64;                   // of one registration, inspection or calibration
inline constexpr int kMostStudyScans = 200;             // of one study: repeats are its point
inline constexpr std::size_t kLongestRequester = 200;   // bytes of requested_by
inline constexpr std::size_t kLongestReason = 1000;     // bytes of what a person says of a decision
inline constexpr std::size_t kLongestLabel = 64;        // bytes of a name that a person gives and nothing refers to
inline constexpr std::size_t kGreatestPageSize = 1000;  // of any list

// INVALID_ARGUMENT with how long it is, never the text itself; a NUL byte is refused too.
absl::Status CheckText(const std::string& field, const std::string& text, std::size_t longest);
// Resource names of one collection, each once, least to most of them.
absl::Status CheckNames(const std::string& field, const std::string& collection,
                        const google::protobuf::RepeatedPtrField<std::string>& names, int least, int most);
// requested_by, and request_id: a UUID or none.
absl::Status CheckCaller(const std::string& requested_by, const std::string& request_id);

}  // namespace sixpoint::runtime
