#include "cli/last_words.h"

#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/service_user.h"
#include "cli/subprocess.h"
#include "refusal/message_text.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kLongestWords = 1000;

std::string TextOf(const nlohmann::json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_string() ? found->get<std::string>() : "";
}

}  // namespace

std::string LastWordsOf(std::string_view log) {
  std::string words;
  std::istringstream lines{std::string(log)};
  for (std::string text; std::getline(lines, text);) {
    const nlohmann::json line = nlohmann::json::parse(text, nullptr, false);
    if (!line.is_object()) {
      if (!text.empty()) words = text;
      continue;
    }
    const std::string level = TextOf(line, "level"), message = TextOf(line, "msg"), address = TextOf(line, "address"),
                      why = TextOf(line, "why");
    if (message == "listening" || message == "serving") words.clear();
    const bool of_a_call = message == "call" || TextOf(line, "from") == "grpc";
    if ((level == "warning" || level == "error") && !of_a_call)
      words = message + (address.empty() ? "" : " " + address) + (why.empty() ? "" : ": " + why);
  }
  const std::string not_ready = "not ready: ";
  if (words.rfind(not_ready, 0) == 0) words.erase(0, not_ready.size());
  return Tame(words, kLongestWords);
}

std::string LastWords(const std::filesystem::path& log) {
  const Finished read = RunProgram(AsServiceUser({"tail", "-n", "100", log.string()}));
  return read.exit_code == 0 ? LastWordsOf(read.output) : "";
}

}  // namespace sixpoint::cli
