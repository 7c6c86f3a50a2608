#include "identity/json_web_token.h"

#include <algorithm>
#include <chrono>
#include <cstdint>

#include "identity/base64url.h"
#include "identity/strict_json.h"

namespace sixpoint::identity {
namespace {

using nlohmann::json;

std::optional<json> ObjectOf(std::string_view part) {
  const std::optional<std::string> text = FromBase64Url(part);
  std::optional<json> object = text ? StrictJsonOf(*text) : std::nullopt;
  return object && object->is_object() ? object : std::nullopt;
}

}  // namespace

std::optional<JsonWebToken> JsonWebTokenOf(std::string_view token, std::size_t most_bytes) {
  const std::size_t first = token.find('.'), last = token.rfind('.');
  if (token.size() > most_bytes || first == last || std::count(token.begin(), token.end(), '.') != 2)
    return std::nullopt;
  std::optional<json> header = ObjectOf(token.substr(0, first));
  std::optional<json> claims = ObjectOf(token.substr(first + 1, last - first - 1));
  std::optional<std::string> signature = FromBase64Url(token.substr(last + 1));
  if (!header || !claims || !signature) return std::nullopt;
  return JsonWebToken{*std::move(header), *std::move(claims), token.substr(0, last), *std::move(signature)};
}

std::optional<TimePoint> TimeIn(const json& claims, const char* name) {
  const auto found = claims.find(name);
  if (found == claims.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto seconds = found->get<std::uint64_t>();
  if (seconds > 7'258'118'400) return std::nullopt;  // the year 2200: what a TimePoint holds
  return TimePoint(std::chrono::seconds(seconds));
}

}  // namespace sixpoint::identity
