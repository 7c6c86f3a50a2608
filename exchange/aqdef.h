// Results as AQDEF's ASCII transfer format (.dfq), for SPC: one file of many parts, one block a machine, operation and operator. Which
// K-field holds what, and which are not used and why: docs/exchange.md, aqdef.
//
// A value carries its verdict and expanded uncertainty as text in K0009, since no field of AQDEF has them. What was not measured has no value:
// a part of which nothing was measured is not in the file.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <string_view>
#include <vector>

#include "exchange/inspected_part.h"

namespace sixpoint::exchange {

// ASCII, ends of line CRLF, times in UTC by the second. INVALID_ARGUMENT as Check; besides where the parts are none, are not all of one part
// revision with the same characteristics, a serial number stands twice at one second, and where a text is not ASCII on one line or
// longer than its field: nothing is cut.
absl::StatusOr<std::string> ToAqdef(const std::vector<InspectedPart>& parts);

inline constexpr std::size_t kMostAqdefBytes = 32 << 20;
inline constexpr std::size_t kMostAqdefCharacteristics = 20000;
// Characteristics times parts, of one file: what they take in memory, which may be far more than the file.
inline constexpr std::size_t kMostAqdefValues = 1000000;

// What a file tells; the values of one serial number and time are one part, in the order of the file, and where it tells neither, the n-th
// values of each characteristic are. A block without values is one part that was not measured. `unit` is as the file has it, empty where it
// tells none. A value without our K0009 is undecidable, for the file judges none. Catalogues (K4xxx), groups (K5xxx) and charts (K8xxx)
// are passed over. INVALID_ARGUMENT names the line.
absl::StatusOr<std::vector<InspectedPart>> FromAqdef(std::string_view file, std::size_t most_values = kMostAqdefValues);

}  // namespace sixpoint::exchange
