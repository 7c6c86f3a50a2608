#include "identity/base64url.h"

#include <cstddef>
#include <cstdint>

namespace sixpoint::identity {
namespace {

constexpr std::string_view kBase64UrlLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
constexpr unsigned kLetter_bits = 6, kByte_bits = 8;

}  // namespace

std::string ToBase64Url(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() * kByte_bits + kLetter_bits - 1) / kLetter_bits);
  std::uint32_t held = 0;
  unsigned held_bits = 0;
  for (const char byte : bytes) {
    held = held << kByte_bits | static_cast<unsigned char>(byte);
    for (held_bits += kByte_bits; held_bits >= kLetter_bits;) {
      held_bits -= kLetter_bits;
      text += kBase64UrlLetters[held >> held_bits & 0x3f];
    }
  }
  if (held_bits > 0) text += kBase64UrlLetters[held << (kLetter_bits - held_bits) & 0x3f];
  return text;
}

std::optional<std::string> FromBase64Url(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size() * kLetter_bits / kByte_bits);
  std::uint32_t held = 0;
  unsigned held_bits = 0;
  for (const char letter : text) {
    const std::size_t value = kBase64UrlLetters.find(letter);
    if (value == std::string_view::npos) return std::nullopt;
    held = held << kLetter_bits | static_cast<std::uint32_t>(value);
    held_bits += kLetter_bits;
    if (held_bits < kByte_bits) continue;
    held_bits -= kByte_bits;
    bytes += static_cast<char>(held >> held_bits & 0xff);
  }
  const bool is_whole = held_bits < kLetter_bits && (held & ((1U << held_bits) - 1)) == 0;
  if (!is_whole) return std::nullopt;
  return bytes;
}

}  // namespace sixpoint::identity
