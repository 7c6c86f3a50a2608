#include "identity/strict_json.h"

#include <set>
#include <string>
#include <vector>

namespace sixpoint::identity {
namespace {

constexpr int kDeepest = 8;

}  // namespace

std::optional<nlohmann::json> StrictJsonOf(std::string_view text) {
  using Event = nlohmann::json::parse_event_t;
  std::vector<std::set<std::string>> keys;
  bool is_strict = true;
  const auto watch = [&](int depth, Event event, nlohmann::json& value) {
    if (depth > kDeepest) is_strict = false;
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end && !keys.empty()) keys.pop_back();
    if (event == Event::key && !keys.empty() && !keys.back().insert(value.get<std::string>()).second) is_strict = false;
    return is_strict;
  };
  nlohmann::json json = nlohmann::json::parse(text, watch, /*allow_exceptions=*/false);
  if (!is_strict || json.is_discarded()) return std::nullopt;
  return json;
}

std::optional<std::string> TextIn(const nlohmann::json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

}  // namespace sixpoint::identity
