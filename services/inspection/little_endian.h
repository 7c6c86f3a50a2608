// Numbers as bytes that are the same on every machine: what digests are made of.
#pragma once

#include <cstddef>
#include <cstring>
#include <string>

namespace sixpoint::inspection {

// Bits: the unsigned integer that is as wide.
template <typename Bits, typename Number>
void Append(Number number, std::string* bytes) {
  Bits bits;
  static_assert(sizeof bits == sizeof number);
  std::memcpy(&bits, &number, sizeof bits);
  for (std::size_t k = 0; k < sizeof bits; ++k) bytes->push_back(static_cast<char>(bits >> (8 * k)));
}

}  // namespace sixpoint::inspection
