// Numbers as bytes that are the same on every machine: what digests are made of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace sixpoint::runtime {

// Bits: the unsigned integer that is as wide.
template <typename Bits, typename Number>
void Append(Number number, std::string* bytes) {
  Bits bits;
  static_assert(sizeof bits == sizeof number);
  std::memcpy(&bits, &number, sizeof bits);
  for (std::size_t k = 0; k < sizeof bits; ++k) bytes->push_back(static_cast<char>(bits >> (8 * k)));
}

// Each of them; as float: those that are kept as such.
inline void AppendReals(const std::vector<double>& numbers, std::string* bytes) {
  for (const double number : numbers) Append<std::uint64_t>(number, bytes);
}
inline void AppendFloats(const std::vector<double>& numbers, std::string* bytes) {
  for (const double number : numbers) Append<std::uint32_t>(static_cast<float>(number), bytes);
}

// The number at a place, which goes on behind it; the bytes must be there.
template <typename Bits, typename Number>
Number Take(const std::string& bytes, std::size_t* at) {
  static_assert(sizeof(Bits) == sizeof(Number));
  Bits bits = 0;
  for (std::size_t k = 0; k < sizeof bits; ++k)
    bits |= static_cast<Bits>(static_cast<unsigned char>(bytes.at((*at)++))) << (8 * k);
  Number number;
  std::memcpy(&number, &bits, sizeof bits);
  return number;
}

}  // namespace sixpoint::runtime
