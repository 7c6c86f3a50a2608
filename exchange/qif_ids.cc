#include <cstdint>
#include <cstdio>
#include <vector>

#include "exchange/qif.h"
#include "exchange/text.h"

namespace sixpoint::exchange {
namespace {

__extension__ using Hash = unsigned __int128;

// The constants of FNV-1a with 128 bits.
constexpr Hash kBasis = (static_cast<Hash>(0x6c62272e07bb0142) << 64) | 0x62b821756295c58d;
constexpr Hash kPrime = (static_cast<Hash>(0x0000000001000000) << 64) | 0x000000000000013b;

// Each name with its length before it, so that no two lists of names are the same bytes.
std::string NameUuid(const std::vector<std::string>& names) {
  Hash hash = kBasis;
  for (const std::string& name : names)
    for (const char c : std::to_string(name.size()) + ":" + name)
      hash = (hash ^ static_cast<unsigned char>(c)) * kPrime;
  std::uint64_t high = static_cast<std::uint64_t>(hash >> 64), low = static_cast<std::uint64_t>(hash);
  high = (high & ~std::uint64_t{0xf000}) | 0x8000;                     // version 8
  low = (low & ~(std::uint64_t{3} << 62)) | (std::uint64_t{2} << 62);  // variant of RFC 9562
  char text[40];
  std::snprintf(text, sizeof text, "%08llx-%04llx-%04llx-%04llx-%012llx", static_cast<unsigned long long>(high >> 32),
                static_cast<unsigned long long>(high >> 16 & 0xffff), static_cast<unsigned long long>(high & 0xffff),
                static_cast<unsigned long long>(low >> 48), static_cast<unsigned long long>(low & 0xffffffffffff));
  return text;
}

}  // namespace

std::string QifPlanId(const InspectedPart& part) {
  std::vector<std::string> names = {"plan", part.part, std::to_string(part.part_revision)};
  for (const Characteristic& c : part.characteristics) {
    names.insert(names.end(), {c.name, c.unit, DecimalText(c.nominal)});
    for (const std::optional<double>& limit : {c.lower, c.upper}) names.push_back(limit ? DecimalText(*limit) : "");
  }
  return NameUuid(names);
}

std::string QifDocumentId(const std::string& result) { return NameUuid({"document", result}); }

std::string QifCharacteristicId(const std::string& part, int revision, const std::string& characteristic) {
  return NameUuid({"characteristic", part, std::to_string(revision), characteristic});
}

}  // namespace sixpoint::exchange
